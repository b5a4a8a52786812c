#pragma once
// The loop over particles, written once for all external fields.
//
// A field offers, for particle i at x,
//   value(i, x)                    V_i
//   gradient(i, x)                 ∇V_i
//   mean_gradient(i, x, x_new)     a discrete gradient: · (x_new − x) = V_i(x_new) − V_i(x)
//   hessian_product(i, x, w)       V_i″ w
// and, where it accelerates everybody alike, acceleration().

#include <utility>

#include "engine/interaction.h"

namespace carom {

template <int D, class Field>
class FieldTerm final : public Interaction<D> {
 public:
  explicit FieldTerm(Field field) : field_(std::move(field)) {}

  void add_energy(Positions<D> x, PotentialSums& sums) const override {
    for (Id i = 0; i < x.size(); ++i) {
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
  std::uint64_t interacting_pairs(Positions<D> x) const override { return x.size(); }
  const Vec<D>* common_acceleration() const override {
    if constexpr (requires { field_.acceleration(); })
      return &field_.acceleration();
    else
      return nullptr;
  }
  bool keeps_momentum() const override { return false; }

 private:
  Field field_;
};

}  // namespace carom
