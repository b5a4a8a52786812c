// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include "engine/forces/potentials/potential.h"

namespace carom {

/// The Coulomb potential of unit charges, damped like the real-space part of an Ewald sum; cut smoothly, it replaces
/// the long-ranged potential in periodic boxes (Wolf, Keblinski, Phillpot, Eggebrecht, J. Chem. Phys. 110 (1999) 8254;
/// Fennell, Gezelter, J. Chem. Phys. 124 (2006) 234104).
///
///   V(r) = C erfc(αr)/r
///   V′ = −½ (V + g)/ρ,   V″ = (½ α² g − (3/2) V′)/ρ,   g = C (2α/√π) e^(−α²ρ)
///   (V(a) − V(b))/(a − b) = C [½ (1/r + 1/s) E − ½ (erfc αr + erfc αs)/(r s)]/(r + s),
///   E = (erfc αs − erfc αr)/(s − r),   r = √b, s = √a
///
/// Both terms in the bracket are negative, so there is no cancellation. E is the mean of −(2α/√π) e^(−α²t²) over [r,
/// s]: from its Taylor series about the midpoint if α|s − r| < 0.03 and α²|a − b| < 0.08 (a usual step), by 8-point
/// Gauss quadrature if α|s − r| < ½ and α²|a − b| < 2, else from the formula. Truncation errors of series and
/// quadrature are below ε/10.
///
/// Errors: a few ulp, plus (αr)² ulp from rounding α²ρ.
class DampedCoulomb {
 public:
  DampedCoulomb(double constant, double damping) : c_(constant), alpha_(damping) {}

  ForceScale scale(double distance) const {
    const double near = std::min(distance, 1 / alpha_), energy = 0x1p-4 * std::abs(c_) / near;
    return {energy / near, energy};
  }

  template <class T>
  T value(T rho) const {
    const T r = elementary::sqrt(rho);
    return c_ * elementary::erfc(alpha_ * r) / r;
  }
  template <class T>
  T derivative(T rho) const {
    return -0.5 * (value(rho) + gauss(rho)) / rho;
  }
  template <class T>
  T second_derivative(T rho) const {
    const T v = value(rho), g = gauss(rho);
    return (0.5 * alpha_ * alpha_ * g + 0.75 * (v + g) / rho) / rho;
  }
  template <class T>
  T quotient(T rho_old, T rho_new) const {
    const T lower = elementary::min(rho_old, rho_new), upper = elementary::max(rho_old, rho_new);
    const T r = elementary::sqrt(lower), s = elementary::sqrt(upper);
    const T difference = (upper - lower) / (r + s);  // s − r without cancellation
    const T erfc_r = elementary::erfc(alpha_ * r), erfc_s = elementary::erfc(alpha_ * s);
    const T m = 0.5 * alpha_ * (r + s), d = 0.5 * alpha_ * difference;
    T mean = mean_by_series(m, d);  // mean of e^(−α²t²) over [r, s]
    const auto wide = !((d < 0.015) & (m * d < 0.02));
    if (elementary::any(wide)) {
      const auto near = (d < 0.25) & (m * d < 0.5);
      const T ends = (erfc_r - erfc_s) / (kTwoOverRootPi * 2 * d);
      mean = wide ? (near ? mean_by_gauss(m, d) : ends) : mean;
    }
    const T slope = -kTwoOverRootPi * alpha_ * mean;
    return 0.5 * c_ * ((r + s) * slope - (erfc_r + erfc_s)) / (r * s * (r + s));
  }

 private:
  static constexpr double kTwoOverRootPi = 0x1.20dd750429b6dp+0;

  template <class T>
  T gauss(T rho) const {
    return c_ * kTwoOverRootPi * alpha_ * elementary::exp(-alpha_ * alpha_ * rho);
  }

  /// The mean of e^(−t²) over [m − d, m + d]: Σ f⁽²ᵏ⁾(m) d²ᵏ/(2k + 1)!, up to d⁶.
  template <class T>
  static T mean_by_series(T m, T d) {
    const T m2 = m * m, d2 = d * d;
    const T second = 4 * m2 - 2;
    const T fourth = (16 * m2 - 48) * m2 + 12;
    const T sixth = ((64 * m2 - 480) * m2 + 720) * m2 - 120;
    return elementary::exp(-m2) * (1 + d2 * (second / 6 + d2 * (fourth / 120 + d2 * sixth / 5040)));
  }

  template <class T>
  static T mean_by_gauss(T m, T d) {
    constexpr double node[4] = {0.18343464249564980494, 0.52553240991632898582, 0.79666647741362673959,
                                0.96028985649753623168};
    constexpr double weight[4] = {0.18134189168918099148, 0.15685332293894364367, 0.11119051722668723527,
                                  0.050614268145188129576};
    T mean = all<T>(0);
    for (int n = 3; n >= 0; --n) {
      const T below = m - node[n] * d, above = m + node[n] * d;
      mean += weight[n] * (elementary::exp(-below * below) + elementary::exp(-above * above));
    }
    return mean;
  }

  double c_;      ///< [energy·length] for unit charges
  double alpha_;  ///< [1/length]
};

static_assert(Potential<DampedCoulomb>);

}  // namespace carom
