// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The flow γ̇ y along x of a sheared box, and the energy that it gives to the motion relative to it.
//
// Between slabs, the velocities of particles are relative to the flow. Within a slab the methods use velocities v in
// the laboratory and unwrapped positions, where the laws of motion are the usual ones and only the images slide. The
// kinetic energy of the motion relative to the flow,
//
//   Σ ½ m (v − γ̇ y)² = Σ ½ m v² − γ̇ Σ m (v_x y − ½ γ̇ y²),
//
// changes in flight by the last sum. Contacts with images that slide add Exchange::shear to Σ ½ m v², and pair forces
// with such images add the integral of ∂V/∂tilt (ForceSums::by_tilt()) over the tilt to Σ ½ m v² + V. Counters::shear
// is the sum of the three.

#include <vector>

#include "engine/integrators/kicks.h"

namespace carom::integrator {

/// The sum over particles above, which is added where velocities change from one frame to the other.
template <int D>
struct FlowEnergy {
  ExactSum booked;  ///< [energy]
  ExactSum undone;  ///< its negative

  void add(const FlowEnergy& other) { booked.add(other.booked), undone.add(other.undone); }

  /// Adds the velocity of the flow at unwrapped positions x to velocities v (sign 1), or takes it off (−1).
  void join(const System<D>& system, Positions<D> x, Vectors<D> v, double sign) {
    const double rate = system.box.shear_rate;
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double flow = system.box.flow(x[i]);
      if (sign > 0) v[i][0] += flow;
      if (system.particles.owns(static_cast<Id>(i))) {
        const double moment = rate * system.particles.mass[i] * x[i][1] * (v[i][0] - 0.5 * flow);
        booked.add(sign * moment);
        undone.add(-sign * moment);
      }
      if (sign < 0) v[i][0] -= flow;
    }
  }
};

/// The flow in a step of a method with kicks: velocities become those in the laboratory until leave(). Does nothing
/// in a box that is not sheared.
template <int D>
class FlowOfStep {
 public:
  FlowOfStep(System<D>& system, Vectors<D> v, const Accelerations<D>& at_start)
      : system_(system), by_tilt_(at_start.by_tilt) {
    if (system.box.shear_rate != 0) energy_.join(system, system.particles.x, v, 1);
  }
  /// Ends the step, with the accelerations at its end, and wraps all positions. The work of pair forces follows from
  /// the trapezoidal rule.
  void leave(double length, Accelerations<D>& at_end, Counters& counters) {
    auto& p = system_.particles;
    if (!system_.box.sheared()) return system_.wrap();
    if (system_.box.shear_rate != 0) {
      energy_.join(system_, p.x, p.v, -1);
      counters.shear.add(system_.decomposition.sum(energy_).booked);
      counters.shear.add(0.5 * length * system_.box.slide() * (by_tilt_ + at_end.by_tilt));
    }
    const std::vector<Image<D>> before = p.image;
    system_.wrap();
    // The images of all partners of a particle that is wrapped along y change by as many boxes.
    at_end.by_tilt -= sum_over_all<D>(
        system_, [&](Id i) { return (p.image[i][1] - before[i][1]) * moving_mass(p.mass[i]) * at_end.a[i][0]; });
  }

 private:
  System<D>& system_;
  double by_tilt_;
  FlowEnergy<D> energy_;
};

}  // namespace carom::integrator
