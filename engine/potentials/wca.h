#pragma once

#include <algorithm>

#include "engine/potentials/lennard_jones.h"
#include "engine/potentials/potential.h"

namespace carom {

/// Weeks–Chandler–Andersen: the repulsive part of Lennard-Jones, up to its minimum at ρ_c = 2^(1/3) σ².
///
///   V(r) = 4ε [(σ/r)¹² − (σ/r)⁶] + ε = ε (2u − 1)²,   u = (σ²/ρ)³;   0 beyond ρ_c
///
/// Derivatives and quotient inside are those of Lennard-Jones. Only V′ is continuous at ρ_c, V″ jumps. The square keeps
/// V's digits there. Errors: as Lennard-Jones.
class Wca {
 public:
  Wca(double epsilon, double sigma) : inside_(epsilon, sigma), epsilon_(epsilon), sigma2_(sigma * sigma) {}

  double cutoff_squared() const { return 0x1.428a2f98d728bp+0 * sigma2_; }  // 2^(1/3)

  double value(double rho) const {
    if (rho >= cutoff_squared()) return 0;
    const double x = sigma2_ / rho;
    const double excess = 2 * (x * x * x) - 1;
    return epsilon_ * excess * excess;
  }
  double derivative(double rho) const { return rho < cutoff_squared() ? inside_.derivative(rho) : 0.0; }
  double second_derivative(double rho) const { return rho < cutoff_squared() ? inside_.second_derivative(rho) : 0.0; }
  double quotient(double rho_old, double rho_new) const {
    const auto [lower, upper] = std::minmax(rho_old, rho_new);
    if (lower >= cutoff_squared()) return 0;
    if (upper >= cutoff_squared()) return -value(lower) / (upper - lower);
    return inside_.quotient(rho_old, rho_new);
  }

 private:
  LennardJones inside_;
  double epsilon_;  ///< V at r = σ [energy]
  double sigma2_;   ///< [length²]
};

static_assert(ShortRanged<Wca>);

}  // namespace carom
