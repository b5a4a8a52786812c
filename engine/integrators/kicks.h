// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The accelerations a = −M⁻¹∇V at the present positions, and the kick v += s a, for verlet, psa, cva and mcva.

#include "engine/forces/forces.h"

namespace carom::integrator {

template <int D>
struct Accelerations {
  std::vector<Vec<D>> a;  ///< [length/time²]
  PotentialSums sums;     ///< at the positions of the last update
  double by_tilt = 0;     ///< ∂V/∂tilt of all particles there, in a sheared box [force]

  /// Call this at the start of a run.
  void start(System<D>& system, Counters& counters) {
    system.fields.add("acceleration", a);
    if (system.box.sheared()) system.fields.add_value("by tilt", by_tilt);
    update(system, counters);
  }
  /// Evaluates a at the system's positions: one force pass.
  void update(const System<D>& system, Counters& counters) { update(system, system.particles.x, counters, {}); }
  /// Evaluates a at x, see evaluate_forces(). If arrive() throws, a has not changed.
  void update(const System<D>& system, Positions<D> x, Counters& counters, const Arrival& arrive) {
    a.resize(system.particles.size());
    evaluate_forces<D>(system, x, a, counters, &sums, arrive);
    for (std::size_t i = 0; i < a.size(); ++i) a[i] /= system.particles.mass[i];
    if (system.box.sheared()) by_tilt = system.decomposition.sum(sums).by_tilt.value();
  }
};

template <int D>
void kick(std::vector<Vec<D>>& v, const std::vector<Vec<D>>& a, double time) {
  for (std::size_t i = 0; i < v.size(); ++i) v[i] += time * a[i];
}

}  // namespace carom::integrator
