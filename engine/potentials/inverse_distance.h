#pragma once

#include <cmath>

#include "engine/potentials/potential.h"

namespace carom {

/// Gravity and the Coulomb potential, for unit masses or charges.
///
///   V(r) = C/r
///   V′ = −C/(2 r³),   V″ = 3C/(4 r⁵),   (V(a) − V(b))/(a − b) = −C/(r s (r + s)),   r = √b, s = √a
///
/// Errors: a few ulp.
class InverseDistance {
 public:
  explicit InverseDistance(double constant) : c_(constant) {}

  double value(double rho) const { return c_ / std::sqrt(rho); }
  double derivative(double rho) const { return -0.5 * c_ / (rho * std::sqrt(rho)); }
  double second_derivative(double rho) const { return 0.75 * c_ / (rho * rho * std::sqrt(rho)); }
  double quotient(double rho_old, double rho_new) const {
    const double r = std::sqrt(rho_old), s = std::sqrt(rho_new);
    return -c_ / (r * s * (r + s));
  }

 private:
  double c_;  ///< [energy·length] for unit weights
};

static_assert(Potential<InverseDistance>);

}  // namespace carom
