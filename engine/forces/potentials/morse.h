// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "engine/forces/potentials/potential.h"

namespace carom {

/// The Morse potential: a soft core and a well of depth D at r₀.
///
///   V(r) = D [(1 − u)² − 1] = D u (u − 2),   u = e^(−α(r − r₀))
///   V′ = −D α u (u − 1)/r,   V″ = D α u [α (2u − 1) + (u − 1)/r]/(2ρ)
///   (V(a) − V(b))/(a − b) = −D α u φ(x) (u + w − 2)/(r + s),   r = √b the smaller, s = √a, u at r, w at s,
///   φ(x) = (1 − e^(−x))/x, x = α(s − r)
///
/// Errors: a few ε of the sum of the magnitudes of repulsion and attraction, plus αr ε from rounding the exponent.
class Morse {
 public:
  Morse(double depth, double alpha, double r0) : depth_(depth), alpha_(alpha), r0_(r0) {}

  ForceScale scale(double) const { return {depth_ * alpha_, depth_}; }

  template <class T>
  T value(T rho) const {
    const T u = decay(elementary::sqrt(rho));
    return depth_ * u * (u - 2);
  }
  template <class T>
  T derivative(T rho) const {
    const T r = elementary::sqrt(rho), u = decay(r);
    return -depth_ * alpha_ * u * (u - 1) / r;
  }
  template <class T>
  T second_derivative(T rho) const {
    const T r = elementary::sqrt(rho), u = decay(r);
    return 0.5 * depth_ * alpha_ * u * (alpha_ * (2 * u - 1) + (u - 1) / r) / rho;
  }
  template <class T>
  T quotient(T rho_old, T rho_new) const {
    const T lower = elementary::min(rho_old, rho_new), upper = elementary::max(rho_old, rho_new);
    const T r = elementary::sqrt(lower), sum = r + elementary::sqrt(upper);
    const T x = alpha_ * ((upper - lower) / sum);  // α(s − r) without cancellation
    const T u = decay(r), fall = elementary::expm1(-x);
    const T mean = x > 0 ? -fall / x : all<T>(1);
    return -depth_ * alpha_ * u * mean * (2 * (u - 1) + u * fall) / sum;
  }
  /// ∫_r^∞ V r^(D−1) dr, using ∫_r^∞ e^(−kr) r^(D−1) dr = e^(−kr) (r²/k + 2r/k² + 2/k³), in two dimensions e^(−kr) (r/k
  /// + 1/k²)
  double tail(double r, int dimension) const {
    const double u = decay(r);
    const auto integral = [&](double k) {
      return dimension == 3 ? (r * r + 2 * (r + 1 / k) / k) / k : (r + 1 / k) / k;
    };
    return depth_ * u * (u * integral(2 * alpha_) - 2 * integral(alpha_));
  }

 private:
  /// u
  template <class T>
  T decay(T r) const {
    return elementary::exp(-alpha_ * (r - r0_));
  }

  double depth_;  ///< D, the depth of the well [energy]
  double alpha_;  ///< [1/length]
  double r0_;     ///< [length]
};

static_assert(Potential<Morse>);

}  // namespace carom
