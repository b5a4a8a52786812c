// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The mean squared displacement of the particles, computed during a run.
//
//   MeanSquaredDisplacement<3> msd(system, {.interval = 0.1});
//   run.add(msd);
//   run.run();
//   for (const auto& row : msd.rows()) use(row.time, row.msd);
//
// Lags are 1 … 9, 10, 20 … 90, 100 … intervals: nine per decade. Each decade has its own origin, which is set again
// after ten of its lags, so that windows follow each other without overlap. A lag of k intervals is averaged over about
// (samples/10^(decade+1)) origins and all particles, a sample costs 10/9 passes over the particles, and one position
// per particle and decade is stored. (A thinned form of the order-n algorithm of Frenkel, Smit, Understanding Molecular
// Simulation, 2nd ed., section 4.4.2.) Displacements are continuous across periodic boundaries; a drift of the whole
// system is not subtracted. In a sheared box they are those across the flow. Sums are exact, so that their order does
// not matter.

#include <cstdint>
#include <vector>

#include "engine/run/observable.h"

namespace carom {

template <int D>
class MeanSquaredDisplacement : public Observable<D> {
 public:
  /// Keeps a reference to the system for its box.
  MeanSquaredDisplacement(const System<D>& system, const Sampling& sampling);
  MeanSquaredDisplacement(const System<D>& system, const Parameters& parameters, double start);

  struct Row {
    double time = 0;               ///< the mean lag: steps may not end at the due times
    std::uint64_t origins = 0;     ///< number of origins averaged over
    double msd = 0;                ///< average over all particles [length²]
    std::vector<double> of;        ///< by species
    Estimate error;                ///< of msd
    std::vector<Estimate> errors;  ///< by species
  };
  /// The rows by ascending lag.
  std::vector<Row> rows() const;
  /// The columns of rows(), with columns by species if there are several species.
  std::vector<TableColumn> table() const override;

 private:
  static constexpr std::uint64_t kLags = 10;  // per decade
  struct Lag {
    std::uint64_t origins = 0;
    ExactSum time;
    std::vector<ExactSum> squares;  // by species
    Blocking series;                // of the means over particles: of all, of each species
    void archive(Archive& archive) { archive(origins, time, squares, series); }
  };
  struct Decade {
    double origin_time;
    std::vector<Vec<D>> origin;
    std::array<Lag, kLags> lag;  // 0 stays empty: it is the first lag of the next decade
    void archive(Archive& archive) { archive(origin_time, origin, lag); }
  };
  void add_sample(double time, const Particles<D>& particles) override;
  void sums(Archive& archive) override { archive(number_, species_, decades_); }
  void add(Lag& lag, double time, const Decade& from);

  const System<D>& system_;
  std::vector<double> number_;  // particles of each species
  std::vector<std::uint16_t> species_;
  std::vector<Vec<D>> now_;
  std::vector<Decade> decades_;
};

}  // namespace carom
