// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Long-range corrections: estimated energy and pressure of a uniform fluid beyond the cutoff.
//
// Between N_a particles of one species and N_b of another (N²/2 pairs within one species), with g(r) = 1,
//
//   E = N_a N_b/Ω S_D ∫ ΔV r^(D−1) dr,   virial = −N_a N_b/Ω S_D ∫ r (dΔV/dr) r^(D−1) dr,   P = virial/(D Ω)
//
// with Ω the volume and S_D = 4π or 2π. If the potential is
//   switched:  ΔV = V − W from r_s to infinity; then virial = D E;
//   shifted:   ΔV = V beyond r_c, the correction of the truncated potential, which has the same forces: the pressure is
//              corrected, but the energy still lacks V(r_c) for each pair within the cutoff.
// (Allen, Tildesley, Computer Simulation of Liquids, 2nd ed., section 2.8.) The corrections exert no forces.

#include <cmath>
#include <numbers>

#include "engine/base/elementary.h"
#include "engine/forces/potentials/cut.h"
#include "engine/laws/interaction.h"

namespace carom {

/// A potential with its integral to infinity: tail(r, D) = ∫_r^∞ V r^(D−1) dr; infinite if the integral diverges.
template <class P>
concept HasTail = Potential<P> && requires(const P potential) {
  { potential.tail(1.0, 3) } -> std::same_as<double>;
};

/// The correction for `pairs` pairs of unit weight in a volume.
template <int D, HasTail P>
Tail tail_correction(const Cut<P>& cut, double pairs, double volume) {
  const double end = std::sqrt(cut.cutoff_squared());
  const double scale = (D == 3 ? 4 : 2) * std::numbers::pi * pairs / volume;
  const double beyond = scale * cut.whole().tail(end, D);
  if (!cut.switched())
    return {beyond, D * beyond + scale * elementary::pow(end, D) * cut.whole().value(cut.cutoff_squared())};
  const double start = std::sqrt(cut.switch_from_squared());
  constexpr int panels = 200;  // each with three Gauss points: errors below 1e-13
  const double half = 0.5 * (end - start) / panels;
  double within = 0;
  for (int panel = 0; panel < panels; ++panel)
    for (const int node : {-1, 0, 1}) {
      const double r = start + half * (2 * panel + 1 + node * std::sqrt(0.6));
      const double weight = half * (node == 0 ? 8.0 : 5.0) / 9;
      within += weight * (cut.whole().value(r * r) - cut.value(r * r)) * elementary::pow(r, D - 1);
    }
  const double energy = scale * within + beyond;
  return {energy, D * energy};
}

}  // namespace carom
