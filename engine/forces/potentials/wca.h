// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "engine/forces/potentials/lennard_jones.h"
#include "engine/forces/potentials/potential.h"

namespace carom {

/// Weeks–Chandler–Andersen: the repulsive part of Lennard-Jones, up to its minimum at ρ_c = 2^(1/3) σ².
///
///   V(r) = 4ε [(σ/r)¹² − (σ/r)⁶] + ε = ε (2u − 1)²,   u = (σ²/ρ)³;   0 beyond ρ_c
///
/// For ρ < ρ_c derivatives and quotient equal the ones of Lennard-Jones. At ρ_c V′ is continuous and V″ jumps; the
/// square keeps the digits of V there. Errors: as for Lennard-Jones.
class Wca {
 public:
  Wca(double epsilon, double sigma)
      : inside_(epsilon, sigma), epsilon_(epsilon), sigma2_(sigma * sigma), cutoff2_(0x1.428a2f98d728bp+0 * sigma2_) {}

  double cutoff_squared() const { return cutoff2_; }

  ForceScale scale(double distance) const { return inside_.scale(distance); }

  template <class T>
  T value(T rho) const {
    const T x = sigma2_ / rho;
    const T excess = 2 * (x * x * x) - 1;
    return rho < cutoff2_ ? epsilon_ * excess * excess : all<T>(0);
  }
  template <class T>
  T derivative(T rho) const {
    return rho < cutoff2_ ? inside_.derivative(rho) : all<T>(0);
  }
  template <class T>
  T second_derivative(T rho) const {
    return rho < cutoff2_ ? inside_.second_derivative(rho) : all<T>(0);
  }
  template <class T>
  T quotient(T rho_old, T rho_new) const {
    const T lower = elementary::min(rho_old, rho_new), upper = elementary::max(rho_old, rho_new);
    return upper < cutoff2_ ? inside_.quotient(rho_old, rho_new)
                            : (lower < cutoff2_ ? -value(lower) / (upper - lower) : all<T>(0));
  }

 private:
  LennardJones inside_;
  double epsilon_;  ///< V at r = σ [energy]
  double sigma2_;   ///< [length²]
  double cutoff2_;  ///< ρ_c: 2^(1/3) σ² [length²]
};

static_assert(ShortRanged<Wca>);

}  // namespace carom
