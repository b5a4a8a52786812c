// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The highest frequency of small vibrations, which limits the length of a step.

#include "engine/base/random.h"
#include "engine/forces/forces.h"

namespace carom {

/// The largest |ω²| [1/time²] of small vibrations about the present positions, an eigenvalue of M⁻¹V″, by power
/// iteration from random directions. 0 without forces. Does not depend on the number of ranks; collective. The mean
/// relative error is at most 0.871 ln(D N)/(kRounds − 1): 0.2 for 10³ particles (Kuczyński, Woźniakowski, SIAM J.
/// Matrix Anal. Appl. 13 (1992) 1094).
template <int D>
double largest_squared_frequency(const System<D>& system) {
  constexpr int kRounds = 40;
  const Particles<D>& p = system.particles;
  const auto n = static_cast<Id>(p.size());
  std::vector<Vec<D>> u(n), w(n), force(n);
  for (Id i = 0; i < n; ++i) {
    RandomStream random(0, RandomPurpose::probe, p.id_of(i));
    for (int k = 0; k < D; ++k) u[i][k] = random.uniform() - 0.5;
  }
  const auto norm = [&] { return std::sqrt(sum_over_all<D>(system, [&](Id i) { return u[i].squaredNorm(); })); };
  Counters uncounted;
  double curvature = norm();
  for (int round = 0; round < kRounds && curvature > 0; ++round) {
    for (std::size_t i = 0; i < n; ++i) w[i] = u[i] / (curvature * std::sqrt(p.mass[i]));
    evaluate_hessian_product<D>(system, p.x, w, force, uncounted);
    for (std::size_t i = 0; i < n; ++i) u[i] = force[i] / std::sqrt(p.mass[i]);
    curvature = norm();
  }
  return curvature;
}

}  // namespace carom
