#pragma once
// The loop over particles, written once for all external fields.
//
// A field offers, for particle i at x,
//   value(i, x)                    V_i
//   gradient(i, x)                 ∇V_i
//   mean_gradient(i, x, x_new)     a discrete gradient: · (x_new − x) = V_i(x_new) − V_i(x)
//   hessian_product(i, x, w)       V_i″ w
//   among(particles)               itself for other particles
// and, where it accelerates everybody alike, acceleration().

#include <algorithm>
#include <utility>

#include "engine/interaction.h"

namespace carom {

template <int D, class Field>
class FieldTerm final : public Interaction<D> {
 public:
  /// `particles` tells who is a ghost, and outlives the term.
  FieldTerm(const Particles<D>& particles, Field field) : particles_(particles), field_(std::move(field)) {}

  void add_energy(Positions<D> x, PotentialSums& sums) const override {
    for (Id i = 0; i < x.size(); ++i) {
      if (!particles_.owns(i)) continue;
      const double v = field_.value(i, x[i]);
      sums.energy.add(v);
      sums.magnitude.add(std::abs(v));
    }
  }
  void add_forces(Positions<D> x, Vectors<D> force) const override {
    for (Id i = 0; i < x.size(); ++i) force[i] -= field_.gradient(i, x[i]);
  }
  void add_mean_forces(Positions<D> x, Positions<D> x_new, Vectors<D> force) const override {
    for (Id i = 0; i < x.size(); ++i) force[i] -= field_.mean_gradient(i, x[i], x_new[i]);
  }
  void add_hessian_product(Positions<D> x, Positions<D> w, Vectors<D> out) const override {
    for (Id i = 0; i < x.size(); ++i) out[i] += field_.hessian_product(i, x[i], w[i]);
  }
  std::uint64_t interacting_pairs(Positions<D> x) const override {
    std::uint64_t owned = 0;
    for (Id i = 0; i < x.size(); ++i) owned += particles_.owns(i) ? 1 : 0;
    return owned;
  }
  const Vec<D>* common_acceleration() const override {
    if constexpr (requires { field_.acceleration(); })
      return &field_.acceleration();
    else
      return nullptr;
  }
  bool keeps_momentum() const override { return false; }
  std::unique_ptr<Interaction<D>> among(const Particles<D>&, const Particles<D>& some) const override {
    return std::make_unique<FieldTerm>(some, field_.among(some));
  }
  double reach(Positions<D>) const override { return 0; }
  double reach(const Particles<D>&, Exchange&) const override { return 0; }

 private:
  const Particles<D>& particles_;
  Field field_;
};

}  // namespace carom
