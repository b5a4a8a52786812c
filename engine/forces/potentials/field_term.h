// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The loop over particles, written once for all external fields.
//
// A field has, for particle i at x,
//   value(i, x)                    V_i
//   gradient(i, x)                 ∇V_i
//   mean_gradient(i, x, x_new)     a discrete gradient: · (x_new − x) = V_i(x_new) − V_i(x)
//   hessian_product(i, x, w)       V_i″ w
//   least_force(distance)          the force at this distance from where it is zero [force]; 0: unknown
//   among(particles)               the field for other particles
// and acceleration(), that of all particles, or null if they have no common one.

#include <algorithm>
#include <utility>

#include "engine/base/error.h"
#include "engine/laws/interaction.h"

namespace carom {

template <int D, class Field>
class FieldTerm final : public Interaction<D> {
 public:
  /// `particles` marks ghosts and must outlive the term.
  FieldTerm(const Particles<D>& particles, Field field) : particles_(particles), field_(std::move(field)) {}

  void add_energy(Positions<D> x, PotentialSums& sums) const override {
    for (Id i = 0; i < x.size(); ++i) {
      if (!particles_.owns(i)) continue;
      const double v = field_.value(i, x[i]);
      sums.energy.add(v);
      sums.magnitude.add(std::abs(v));
    }
  }
  void add_fluxes(Positions<D>, Positions<D>, PairFluxes<D>&) const override {}
  void add_forces(Positions<D> x, ForceSums<D>& forces, PotentialSums* sums) const override {
    const ForceLimits limits = forces.make_room(1);
    for (Id i = 0; i < x.size(); ++i)
      if (particles_.owns(i) && !forces.add(i, -field_.gradient(i, x[i]), limits))
        throw Error(Failure::numerical, "the force on particle " + std::to_string(particles_.id_of(i)) +
                                            " is too large or no number; use a smaller integrator.step");
    if (sums) add_energy(x, *sums);
  }
  std::uint64_t add_mean_forces(Positions<D> x, Positions<D> x_new, ForceSums<D>& forces, const char* changed,
                                int sign) const override {
    const ForceLimits limits = forces.make_room(1);
    std::uint64_t count = 0;
    for (Id i = 0; i < x.size(); ++i) {
      if (!particles_.owns(i) || (changed && changed[i] == 0)) continue;
      if (!forces.add(i, -sign * field_.mean_gradient(i, x[i], x_new[i]), limits)) forces.invalidate();
      ++count;
    }
    return count;
  }
  void add_hessian_product(Positions<D> x, Positions<D> w, ForceSums<D>& out) const override {
    const ForceLimits limits = out.make_room(1);
    for (Id i = 0; i < x.size(); ++i)
      if (particles_.owns(i) && !out.add(i, field_.hessian_product(i, x[i], w[i]), limits)) out.invalidate();
  }
  std::uint64_t interacting_pairs(Positions<D> x) const override {
    std::uint64_t owned = 0;
    for (Id i = 0; i < x.size(); ++i) owned += particles_.owns(i) ? 1 : 0;
    return owned;
  }
  const Vec<D>* common_acceleration() const override {
    if constexpr (requires { field_.acceleration(); })
      return field_.acceleration();
    else
      return nullptr;
  }
  ForceScale scale(double distance) const override { return {kForceFraction * field_.least_force(distance), 0}; }
  bool keeps_momentum() const override { return false; }
  std::unique_ptr<Interaction<D>> among(const Particles<D>& some) const override {
    return std::make_unique<FieldTerm>(some, field_.among(some));
  }
  double reach(Positions<D>) const override { return 0; }
  double reach(const Particles<D>&, Communicator&) const override { return 0; }

 private:
  static constexpr double kForceFraction = 0x1p-8;  // small, so that accelerations of light particles keep their digits

  const Particles<D>& particles_;
  Field field_;
};

}  // namespace carom
