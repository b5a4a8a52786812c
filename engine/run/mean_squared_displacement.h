// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The mean squared displacement of the particles, taken while a run goes on.
//
//   MeanSquaredDisplacement<3> msd(system, {.interval = 0.1});
//   run.add(msd);
//   run.run();
//   for (const auto& row : msd.rows()) use(row.time, row.msd);
//
// Lags are 1 … 9, 10, 20 … 90, 100 … intervals: nine a decade. Each decade has an origin of its own, which is put anew
// after ten of its lags, so that windows follow each other without overlap, a lag of k intervals is averaged over about
// (samples/10^(decade+1)) origins and all particles, a sample costs 10/9 passes over the particles, and what is kept is
// one position a particle and decade. (A thinned form of the order-n algorithm of Frenkel, Smit, Understanding
// Molecular Simulation, 2nd ed., section 4.4.2.) Displacements are followed through periodic boundaries; a drift of the
// whole system is not taken out. Sums are exact, so that no order of summation matters.

#include <cstdint>
#include <vector>

#include "engine/run/observable.h"

namespace carom {

template <int D>
class MeanSquaredDisplacement : public Observable<D> {
 public:
  /// Keeps a reference to the system, for its box.
  MeanSquaredDisplacement(const System<D>& system, const Sampling& sampling);
  MeanSquaredDisplacement(const System<D>& system, const Parameters& parameters, double start);

  struct Row {
    double time = 0;            ///< the lag; its mean, where steps do not meet the due times
    std::uint64_t origins = 0;  ///< averaged over
    double msd = 0;             ///< of all particles [length²]
    std::vector<double> of;     ///< of each species
  };
  /// By lag, ascending.
  std::vector<Row> rows() const;
  /// The rows; the species only where there are several.
  std::vector<TableColumn> table() const override;

 private:
  static constexpr std::uint64_t kLags = 10;  // of a decade
  struct Lag {
    std::uint64_t origins = 0;
    ExactSum time;
    std::vector<ExactSum> squares;  // of each species
    void archive(Archive& archive) { archive(origins, time, squares); }
  };
  struct Decade {
    double origin_time;
    std::vector<Vec<D>> origin;
    std::array<Lag, kLags> lag;  // 0 stays empty: that is the first lag of the next decade
    void archive(Archive& archive) { archive(origin_time, origin, lag); }
  };
  void add_sample(double time, const Particles<D>& particles) override;
  void sums(Archive& archive) override { archive(number_, species_, decades_); }
  void add(Lag& lag, double time, const Decade& from);

  const System<D>& system_;
  std::vector<double> number_;  // of particles of each species
  std::vector<std::uint16_t> species_;
  std::vector<Vec<D>> now_;
  std::vector<Decade> decades_;
};

}  // namespace carom
