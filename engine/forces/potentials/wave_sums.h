// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The sums over charges and waves of an Ewald sum: amplitudes from all charges, and forces of waves on own charges.

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "engine/base/particles.h"
#include "engine/forces/potentials/ewald_waves.h"
#include "engine/ranks/communicator.h"

namespace carom {

class WaveSums {
 public:
  using Positions = std::span<const Vec<3>>;

  /// `charge` is by particle, `largest` the largest |charge|, and `total` the number of particles on all ranks.
  /// `particles` marks ghosts and must outlive the sums, like `charge`.
  WaveSums(std::shared_ptr<const Waves> waves, const Particles<3>& particles, const std::vector<double>& charge,
           double largest, std::size_t total);

  /// The charges are divided among these ranks. All functions that return amplitudes are collective.
  void join(Communicator& ranks) { ranks_ = &ranks; }
  Communicator& ranks() const { return *ranks_; }
  const Waves& waves() const { return *waves_; }
  const std::shared_ptr<const Waves>& shared() const { return waves_; }
  /// The charges of this rank.
  const std::vector<Id>& charged() const;

  /// S(k) = Σ q e^(ik·x), its derivative along w, and Σ q v_a e^(ik·x) for each component of v.
  Amplitudes structure(Positions x) const;
  Amplitudes structure_change(Positions x, Positions w) const;
  std::array<Amplitudes, 3> current(Positions x, Positions v) const;
  /// The potential of S, which the functions below take as `field`.
  Amplitudes potential(const Amplitudes& s) const;

  /// The forces on own charges; zero for other particles, as in the functions below.
  std::vector<Vec<3>> pull(Positions x, const Amplitudes& field) const;
  /// The changes of the forces as charges move along w in a constant field.
  std::vector<Vec<3>> pull_change(Positions x, const Amplitudes& field, Positions w) const;
  /// The mean forces on charges that move by 2 `half` about x: a unit charge feels Σ_k k sinc(k·half) Im[field*
  /// e^(ik·x)].
  std::vector<Vec<3>> pull_moved(Positions x, const Amplitudes& field, Positions half) const;

 private:
  void for_each_part(Positions x, auto&& visit) const;
  Amplitudes sum(Positions x, int exponent, auto&& add) const;
  std::vector<Vec<3>> per_charge(Positions x, auto&& add) const;
  double longest(Positions vectors) const;

  std::shared_ptr<const Waves> waves_;
  const Particles<3>& particles_;
  const std::vector<double>& charge_;
  double largest_;
  std::size_t total_;
  Communicator alone_;
  Communicator* ranks_ = &alone_;
  const WaveKernels* kernels_ = &widest_kernels<WaveKernels>();
  // Caches and scratch, which do not affect the sums.
  mutable std::vector<Phases> phases_;  // of some charges, along three axes each
  struct Turns {
    Vec<3> x;
    std::array<std::array<double, 2>, 3> of;
  };
  mutable std::vector<Turns> turns_;  // cosine and sine of 2πx/L where each particle was looked at last
  mutable std::vector<Id> charged_;
};

/// Real and imaginary part of the wave of ±c of an entry.
inline std::array<double, 2> wave_of(const Amplitudes& s, std::size_t k, int sign) {
  const auto part = [&](unsigned product) { return s[place_of(k, product)]; };
  return {part(0) - sign * part(1), part(3) + sign * part(2)};
}

}  // namespace carom
