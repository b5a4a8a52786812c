// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "engine/base/elementary.h"
#include "engine/forces/potentials/potential.h"

namespace carom {

/// Lennard-Jones.
///
///   V(r) = 4ε [(σ/r)¹² − (σ/r)⁶] = 4ε u (u − 1),   u = x³, x = σ²/ρ
///   V′ = −(12ε/σ²) x u (2u − 1),   V″ = 24ε u (7u − 2)/ρ²
///   (V(a) − V(b))/(a − b) = −(4ε/σ²) x y (x² + y² + x y)(u + w − 1),   x, u at b; y, w = y³ at a
///
/// Errors: a few ε of the sum of the magnitudes of repulsion and attraction.
class LennardJones {
 public:
  LennardJones(double epsilon, double sigma)
      : epsilon_(epsilon), sigma2_(sigma * sigma), slope_(-12 * epsilon / sigma2_), chord_(-4 * epsilon / sigma2_) {}

  ForceScale scale(double) const { return {24 * epsilon_ / std::sqrt(sigma2_), epsilon_}; }

  template <class T>
  T value(T rho) const {
    const T u = cube(sigma2_ / rho);
    return 4 * epsilon_ * u * (u - 1);
  }
  template <class T>
  T derivative(T rho) const {
    const T x = sigma2_ / rho, u = cube(x);
    return slope_ * (x * u) * (2 * u - 1);
  }
  template <class T>
  T second_derivative(T rho) const {
    const T u = cube(sigma2_ / rho);
    return 24 * epsilon_ * u * (7 * u - 2) / (rho * rho);
  }
  template <class T>
  T quotient(T rho_old, T rho_new) const {
    const T x = sigma2_ / rho_old, y = sigma2_ / rho_new;
    return chord_ * (x * y) * (x * x + y * y + x * y) * (cube(x) + cube(y) - 1);
  }
  /// ∫_r^∞ V r^(D−1) dr = 4ε r^D [u²/(12 − D) − u/(6 − D)]
  double tail(double r, int dimension) const {
    const double u = cube(sigma2_ / (r * r));
    return 4 * epsilon_ * elementary::pow(r, dimension) * u * (u / (12 - dimension) - 1.0 / (6 - dimension));
  }

 private:
  template <class T>
  static T cube(T x) {
    return x * x * x;
  }

  double epsilon_;        ///< depth of the well [energy]
  double sigma2_;         ///< [length²]
  double slope_, chord_;  ///< factors of V′ and of the quotient [energy/length²]
};

static_assert(Potential<LennardJones>);

}  // namespace carom
