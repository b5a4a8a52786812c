// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "engine/forces/potentials/pair_term.h"

namespace carom {

/// V_i = −w_i g·x, a field for FieldTerm. w is the mass, and every particle that is not fixed has the acceleration g;
/// or it is the charge, and g is an electric field.
template <int D>
class UniformField {
 public:
  UniformField(PairWeight weight, const Particles<D>& particles, const Vec<D>& g)
      : kind_(weight), weight_(pair_factors(weight, particles)), g_(g) {}

  UniformField among(const Particles<D>& some) const { return {kind_, some, g_}; }
  double least_force(double) const {
    double least = std::numeric_limits<double>::infinity();
    for (const double w : *weight_)
      for (int k = 0; k < D; ++k)
        if (moving_mass(w) * g_[k] != 0) least = std::min(least, std::abs(w * g_[k]));
    return least < std::numeric_limits<double>::infinity() ? least : 0;
  }
  double value(Id i, const Vec<D>& x) const { return -moving_mass((*weight_)[i]) * g_.dot(x); }
  Vec<D> gradient(Id i, const Vec<D>&) const { return -moving_mass((*weight_)[i]) * g_; }
  Vec<D> mean_gradient(Id i, const Vec<D>& x, const Vec<D>&) const { return gradient(i, x); }
  Vec<D> hessian_product(Id, const Vec<D>&, const Vec<D>&) const { return Vec<D>::Zero(); }
  const Vec<D>* acceleration() const { return kind_ == PairWeight::masses ? &g_ : nullptr; }

 private:
  PairWeight kind_;  // masses or charges
  const std::vector<double>* weight_;
  Vec<D> g_;  ///< [length/time²] or [force/charge]
};

}  // namespace carom
