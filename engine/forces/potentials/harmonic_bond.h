// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "engine/forces/potentials/potential.h"

namespace carom {

/// A spring between two particles.
///
///   V(r) = ½ k (r − L)²
///   V′ = ½ k (r − L)/r,   V″ = k L/(4 r³),   (V(a) − V(b))/(a − b) = ½ k (r + s − 2L)/(r + s),   r = √b, s = √a
///
/// Errors: V′ and the quotient to a few ε of ½ k max(1, L/r); both are zero at r = L.
class HarmonicBond {
 public:
  HarmonicBond(double stiffness, double rest_length) : half_k_(0.5 * stiffness), length_(rest_length) {}

  ForceScale scale(double distance) const {
    const double stretch = 0x1p-6 * (length_ > 0 ? length_ : distance);
    return {2 * half_k_ * stretch, half_k_ * stretch * stretch};
  }

  template <class T>
  T value(T rho) const {
    const T stretch = elementary::sqrt(rho) - length_;
    return half_k_ * stretch * stretch;
  }
  template <class T>
  T derivative(T rho) const {
    if (length_ == 0) return all<T>(half_k_);  // also valid if the particles coincide
    const T r = elementary::sqrt(rho);
    return half_k_ * ((r - length_) / r);
  }
  template <class T>
  T second_derivative(T rho) const {
    if (length_ == 0) return all<T>(0);
    return 0.5 * half_k_ * length_ / (rho * elementary::sqrt(rho));
  }
  template <class T>
  T quotient(T rho_old, T rho_new) const {
    if (length_ == 0) return all<T>(half_k_);
    const T r = elementary::sqrt(rho_old), s = elementary::sqrt(rho_new);
    return half_k_ * (((r - length_) + (s - length_)) / (r + s));
  }

 private:
  double half_k_;  ///< [energy/length²]
  double length_;  ///< [length]
};

static_assert(Potential<HarmonicBond>);

}  // namespace carom
