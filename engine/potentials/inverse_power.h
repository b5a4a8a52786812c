#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/elementary.h"
#include "engine/potentials/potential.h"

namespace carom {

/// Soft spheres with any real exponent.
///
///   V(r) = ε (σ/r)^p = ε (σ²/ρ)^n,   n = p/2
///   V′ = −n V/ρ,   V″ = n (n + 1) V/ρ²
///   (V(a) − V(b))/(a − b) = V(b) expm1(−n log1p((a − b)/b))/(a − b),   b the smaller of the two
///
/// Errors: a few ulp, in the quotient n ulp more at most (the exponent's own rounding).
class InversePower {
 public:
  InversePower(double epsilon, double sigma, double exponent)
      : epsilon_(epsilon), sigma2_(sigma * sigma), n_(0.5 * exponent) {}

  double value(double rho) const { return epsilon_ * elementary::pow(sigma2_ / rho, n_); }
  double derivative(double rho) const { return -n_ * value(rho) / rho; }
  double second_derivative(double rho) const { return n_ * (n_ + 1) * value(rho) / (rho * rho); }
  double quotient(double rho_old, double rho_new) const {
    const auto [lower, upper] = std::minmax(rho_old, rho_new);
    const double difference = upper - lower;
    if (difference == 0) return derivative(lower);
    return value(lower) * elementary::expm1(-n_ * elementary::log1p(difference / lower)) / difference;
  }
  /// ∫_r^∞ V r^(D−1) dr = V r^D/(p − D), infinite for p ≤ D
  double tail(double r, int dimension) const {
    if (2 * n_ <= dimension) return std::numeric_limits<double>::infinity();
    return value(r * r) * std::pow(r, dimension) / (2 * n_ - dimension);
  }

 private:
  double epsilon_;  ///< V at r = σ [energy]
  double sigma2_;   ///< [length²]
  double n_;
};

static_assert(Potential<InversePower>);

}  // namespace carom
