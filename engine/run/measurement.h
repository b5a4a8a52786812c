// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Measures one state of a system.

#include "engine/forces/forces.h"
#include "engine/run/simulation.h"

namespace carom {

template <int D>
struct Measurement {
  Snapshot<D> shot;      ///< its energies, momentum and temperature
  double magnitude = 0;  ///< K + Σ|V| [energy]
  double virial = 0;     ///< Σ m v² + Σ d·F, with its long-range corrections [energy]
  double speed = 0;      ///< mean |v| of the particles that are not fixed [length/time]
};

/// The long-range corrections of all terms of V.
template <int D>
Tail tail_of(const System<D>& system) {
  Tail sum;
  for (const auto& term : system.interactions) {
    sum.energy += term->tail().energy;
    sum.virial += term->tail().virial;
  }
  return sum;
}

/// The measurement that follows from the sums over all ranks.
template <int D>
Measurement<D> measured(const System<D>& system, const MotionSums<D>& motion, const PotentialSums& sums,
                        const Tail& tail) {
  const double kinetic = motion.kinetic.value(), rotational = motion.rotational.value();
  Measurement<D> found;
  const double of_steps = motion.steps.energy.value();
  found.magnitude = kinetic + rotational + sums.magnitude.value() + std::abs(of_steps);
  found.virial = 2 * kinetic + sums.virial.value() + tail.virial;
  found.shot.kinetic = kinetic + rotational;
  found.shot.rotational = rotational;
  found.shot.potential = sums.energy.value() + of_steps + tail.energy;
  found.shot.step_energy = of_steps;
  found.shot.bonds = static_cast<double>(motion.steps.inside) / static_cast<double>(system.size());
  for (int k = 0; k < D; ++k) found.shot.momentum[k] = motion.momentum[k].value();
  if (const auto total = static_cast<double>(system.moving()); total > 0) {
    found.shot.temperature = 2 * kinetic / (D * total);
    constexpr int freedoms = Spin<D>::SizeAtCompileTime;
    found.shot.rotational_temperature = 2 * rotational / (freedoms * total);
    found.speed = motion.speed.value() / total;
  }
  return found;
}

/// Measures the momentum of `state` and everything else of `at`, to which `sums` must belong. Collective.
template <int D>
Measurement<D> measure(const System<D>& system, const Particles<D>& state, const Particles<D>& at,
                       const PotentialSums& sums, const Tail& tail) {
  return measured(system, system.decomposition.sum(own_motion(system, state, at)), sums, tail);
}

/// The pressure for a virial [energy].
template <int D>
double pressure_of(double virial, const Box<D>& box, double time) {
  return virial / (D * box.lengths(time).prod());
}

}  // namespace carom
