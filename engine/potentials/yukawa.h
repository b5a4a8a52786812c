#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/elementary.h"
#include "engine/potentials/potential.h"

namespace carom {

/// Screened Coulomb repulsion or attraction (Debye–Hückel, DLVO).
///
///   V(r) = A e^(−κr)/r
///   V′ = −V (1 + κr)/(2ρ),   V″ = V (3 + 3κr + κ²ρ)/(4ρ²)
///   (V(a) − V(b))/(a − b) = −A e^(−κr) (1 + κr φ(κ(s − r)))/(r s (r + s)),   φ(x) = (1 − e^(−x))/x,
///   r the smaller and s the larger of √a, √b
///
/// Errors: a few ulp, and κr ulp more from rounding the exponent.
class Yukawa {
 public:
  Yukawa(double amplitude, double kappa) : amplitude_(amplitude), kappa_(kappa) {}

  double value(double rho) const {
    const double r = std::sqrt(rho);
    return amplitude_ * elementary::exp(-kappa_ * r) / r;
  }
  double derivative(double rho) const { return -0.5 * value(rho) * (1 + kappa_ * std::sqrt(rho)) / rho; }
  double second_derivative(double rho) const {
    const double u = kappa_ * std::sqrt(rho);
    return 0.25 * value(rho) * (3 + u * (3 + u)) / (rho * rho);
  }
  double quotient(double rho_old, double rho_new) const {
    const auto [lower, upper] = std::minmax(rho_old, rho_new);
    const double r = std::sqrt(lower), s = std::sqrt(upper);
    const double x = kappa_ * ((upper - lower) / (r + s));  // κ(s − r) without its cancellation
    const double phi = x > 0 ? -elementary::expm1(-x) / x : 1.0;
    return -amplitude_ * elementary::exp(-kappa_ * r) * (1 + kappa_ * r * phi) / (r * s * (r + s));
  }
  /// ∫_r^∞ V r^(D−1) dr = A e^(−κr) (1 + κr)/κ² or, in two dimensions, A e^(−κr)/κ; infinite for κ = 0
  double tail(double r, int dimension) const {
    if (kappa_ == 0) return std::numeric_limits<double>::infinity();
    const double v = amplitude_ * elementary::exp(-kappa_ * r);
    return dimension == 3 ? v * (1 + kappa_ * r) / (kappa_ * kappa_) : v / kappa_;
  }

 private:
  double amplitude_;  ///< [energy·length]
  double kappa_;      ///< [1/length]
};

static_assert(Potential<Yukawa>);

}  // namespace carom
