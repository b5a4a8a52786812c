// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "engine/forces/potentials/potential.h"

namespace carom {

/// Gravity or the Coulomb potential, for unit masses or charges.
///
///   V(r) = C/r
///   V′ = −C/(2 r³),   V″ = 3C/(4 r⁵),   (V(a) − V(b))/(a − b) = −C/(r s (r + s)),   r = √b, s = √a
///
/// Errors: a few ulp.
class InverseDistance {
 public:
  explicit InverseDistance(double constant) : c_(constant) {}

  ForceScale scale(double distance) const {
    const double energy = 0x1p-4 * std::abs(c_) / distance;
    return {energy / distance, energy};
  }

  template <class T>
  T value(T rho) const {
    return c_ / elementary::sqrt(rho);
  }
  template <class T>
  T derivative(T rho) const {
    return -0.5 * c_ / (rho * elementary::sqrt(rho));
  }
  template <class T>
  T second_derivative(T rho) const {
    return 0.75 * c_ / (rho * rho * elementary::sqrt(rho));
  }
  template <class T>
  T quotient(T rho_old, T rho_new) const {
    const T r = elementary::sqrt(rho_old), s = elementary::sqrt(rho_new);
    return -c_ / (r * s * (r + s));
  }

 private:
  double c_;  ///< [energy·length] for unit weights
};

static_assert(Potential<InverseDistance>);

}  // namespace carom
