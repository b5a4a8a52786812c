#pragma once

#include <cmath>

#include "engine/potentials/potential.h"

namespace carom {

/// A spring between two particles.
///
///   V(r) = ½ k (r − L)²
///   V′ = ½ k (r − L)/r,   V″ = k L/(4 r³),   (V(a) − V(b))/(a − b) = ½ k (r + s − 2L)/(r + s),   r = √b, s = √a
///
/// Errors: V′ and the quotient to a few ε of ½ k max(1, L/r); they pass zero at r = L.
class HarmonicBond {
 public:
  HarmonicBond(double stiffness, double rest_length) : half_k_(0.5 * stiffness), length_(rest_length) {}

  double value(double rho) const {
    const double stretch = std::sqrt(rho) - length_;
    return half_k_ * stretch * stretch;
  }
  double derivative(double rho) const {
    if (length_ == 0) return half_k_;  // also where the particles coincide
    const double r = std::sqrt(rho);
    return half_k_ * ((r - length_) / r);
  }
  double second_derivative(double rho) const {
    if (length_ == 0) return 0;
    return 0.5 * half_k_ * length_ / (rho * std::sqrt(rho));
  }
  double quotient(double rho_old, double rho_new) const {
    if (length_ == 0) return half_k_;
    const double r = std::sqrt(rho_old), s = std::sqrt(rho_new);
    return half_k_ * (((r - length_) + (s - length_)) / (r + s));
  }

 private:
  double half_k_;  ///< [energy/length²]
  double length_;  ///< [length]
};

static_assert(Potential<HarmonicBond>);

}  // namespace carom
