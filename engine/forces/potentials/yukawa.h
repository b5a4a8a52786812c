// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/forces/potentials/potential.h"

namespace carom {

/// Screened Coulomb repulsion or attraction (Debye–Hückel, DLVO).
///
///   V(r) = A e^(−κr)/r
///   V′ = −V (1 + κr)/(2ρ),   V″ = V (3 + 3κr + κ²ρ)/(4ρ²)
///   (V(a) − V(b))/(a − b) = −A e^(−κm) (cosh y + κm sinh(y)/y)/(r s (r + s)),   m = ½(r + s), y = ½κ(s − r),
///   r = √b, s = √a; for |y| ≥ ½ the product is e^(−κr) (1 + κr φ(2|y|)), φ(x) = (1 − e^(−x))/x, r the smaller
///
/// Errors: a few ulp, plus κr ulp from rounding the exponent.
class Yukawa {
 public:
  /// `contact`: a lower bound of the distance of pairs [length], used by scale(): with wide cores V(1/κ) is not
  /// typical.
  Yukawa(double amplitude, double kappa, double contact = 0)
      : amplitude_(amplitude), kappa_(kappa), contact_(contact) {}

  ForceScale scale(double distance) const {
    const auto size = [&](double r) { return 0x1p-2 * std::abs(value(r * r)); };
    const double near = std::max(contact_, std::min(distance, 1 / kappa_));
    double energy = size(near);
    // Without a contact distance: if V is much weaker at typical distances, pairs rarely come so close.
    if (near > contact_) energy = std::clamp(0x1p4 * size(distance), 0x1p-16 * energy, energy);
    return {energy / near, energy};
  }

  template <class T>
  T value(T rho) const {
    const T r = elementary::sqrt(rho);
    return amplitude_ * elementary::exp(-kappa_ * r) / r;
  }
  template <class T>
  T derivative(T rho) const {
    return -0.5 * value(rho) * (1 + kappa_ * elementary::sqrt(rho)) / rho;
  }
  template <class T>
  T second_derivative(T rho) const {
    const T u = kappa_ * elementary::sqrt(rho);
    return 0.25 * value(rho) * (3 + u * (3 + u)) / (rho * rho);
  }
  template <class T>
  T quotient(T rho_old, T rho_new) const {
    const T r = elementary::sqrt(rho_old), s = elementary::sqrt(rho_new), sum = r + s;
    const T m = 0.5 * kappa_ * sum;
    const T y = 0.5 * kappa_ * (elementary::abs(rho_new - rho_old) / sum);  // κ(s − r)/2 without cancellation
    const T z = y * y;
    const T cosh =
        1 + z * (1.0 / 2 +
                 z * (1.0 / 24 +
                      z * (1.0 / 720 +
                           z * (1.0 / 40320 + z * (1.0 / 3628800 + z * (1.0 / 479001600 + z * (1.0 / 87178291200)))))));
    const T sinh =
        1 + z * (1.0 / 6 +
                 z * (1.0 / 120 +
                      z * (1.0 / 5040 +
                           z * (1.0 / 362880 + z * (1.0 / 39916800 + z * (1.0 / 6227020800 +
                                                                          z * (1.0 / 1307674368000)))))));  // sinh(y)/y
    T mean = elementary::exp(-m) * (cosh + m * sinh);
    const auto far = !(y < 0.5);
    if (elementary::any(far)) {
      const T u = kappa_ * elementary::min(r, s), x = 2 * y;
      const T wide = elementary::exp(-u) * (1 - u * (elementary::expm1(-x) / x));
      mean = far ? wide : mean;
    }
    return -amplitude_ * mean / (r * s * sum);
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
  double contact_;    ///< [length]
};

static_assert(Potential<Yukawa>);

}  // namespace carom
