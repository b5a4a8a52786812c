// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/elementary.h"
#include "engine/forces/potentials/potential.h"

namespace carom {

/// Soft spheres with any real exponent.
///
///   V(r) = ε (σ/r)^p = ε (σ²/ρ)^n,   n = p/2
///   V′ = −n V/ρ,   V″ = n (n + 1) V/ρ²
///   (V(a) − V(b))/(a − b) = V(b) expm1(−n log1p((a − b)/b))/(a − b),   b the smaller of the two
///
/// Errors: a few ulp; for the quotient up to n ulp more, from rounding the exponent.
class InversePower {
 public:
  InversePower(double epsilon, double sigma, double exponent)
      : epsilon_(epsilon), sigma2_(sigma * sigma), n_(0.5 * exponent) {}

  ForceScale scale(double distance) const {
    const double energy = std::abs(value(distance * distance)), sigma = std::sqrt(sigma2_);
    return {std::max(2 * n_ * energy / distance, 0x1p-16 * 2 * n_ * std::abs(epsilon_) / sigma),
            std::max(energy, 0x1p-16 * std::abs(epsilon_))};
  }

  template <class T>
  T value(T rho) const {
    return epsilon_ * elementary::pow(sigma2_ / rho, n_);
  }
  template <class T>
  T derivative(T rho) const {
    return -n_ * value(rho) / rho;
  }
  template <class T>
  T second_derivative(T rho) const {
    return n_ * (n_ + 1) * value(rho) / (rho * rho);
  }
  template <class T>
  T quotient(T rho_old, T rho_new) const {
    const T lower = elementary::min(rho_old, rho_new), difference = elementary::max(rho_old, rho_new) - lower;
    const T growth = elementary::expm1(-n_ * elementary::log1p(difference / lower));
    const T v = value(lower);
    return difference == 0.0 ? -n_ * v / lower : v * growth / difference;
  }
  /// ∫_r^∞ V r^(D−1) dr = V r^D/(p − D), infinite for p ≤ D
  double tail(double r, int dimension) const {
    if (2 * n_ <= dimension) return std::numeric_limits<double>::infinity();
    return value(r * r) * elementary::pow(r, dimension) / (2 * n_ - dimension);
  }

 private:
  double epsilon_;  ///< V at r = σ [energy]
  double sigma2_;   ///< [length²]
  double n_;
};

static_assert(Potential<InversePower>);

}  // namespace carom
