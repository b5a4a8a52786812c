#pragma once

#include "engine/potentials/potential.h"

namespace carom {

/// How a potential ends at its cutoff.
enum class CutKind {
  smooth,  ///< V, V′ and V″ go to zero: methods keep their order
  shifted  ///< only V goes to zero: the force jumps, which costs time-stepping methods their order
};

/// A potential made to end at ρ_c by subtracting a polynomial in ρ, so that its quotient stays in closed form.
///
///   W(ρ) = V(ρ) − V(ρ_c) − c₁ (ρ − ρ_c) − ½ c₂ (ρ − ρ_c)²,   0 from ρ_c outwards
///   smooth: c₁ = V′(ρ_c), c₂ = V″(ρ_c) (then W is C² at ρ_c);   shifted: c₁ = c₂ = 0
///   (W(a) − W(b))/(a − b) = Q(b, a) − c₁ − ½ c₂ ((a − ρ_c) + (b − ρ_c)),   Q the quotient of V
///   one of them, z, inside and the other outside: W(z)/(±(a − b)),   W(z) = (z − ρ_c) · (the quotient of W up to ρ_c)
///
/// Errors: those of V, and near the cutoff a few ε of c₁ (in V′ and quotient) and c₂ (in V″), whose differences go to
/// zero.
template <Potential P>
class Cut {
 public:
  Cut(P potential, double cutoff, CutKind kind) : potential_(potential), cutoff2_(cutoff * cutoff) {
    if (kind == CutKind::shifted) return;
    slope_ = potential_.derivative(cutoff2_);
    half_curvature_ = 0.5 * potential_.second_derivative(cutoff2_);
  }

  double cutoff_squared() const { return cutoff2_; }

  template <class T>
  T value(T rho) const {
    const T z = rho - cutoff2_;
    const T inside = z * (potential_.quotient(all<T>(cutoff2_), rho) - slope_ - half_curvature_ * z);
    return rho < cutoff2_ ? inside : all<T>(0);
  }
  template <class T>
  T derivative(T rho) const {
    const T inside = potential_.derivative(rho) - slope_ - 2 * half_curvature_ * (rho - cutoff2_);
    return rho < cutoff2_ ? inside : all<T>(0);
  }
  template <class T>
  T second_derivative(T rho) const {
    return rho < cutoff2_ ? potential_.second_derivative(rho) - 2 * half_curvature_ : all<T>(0);
  }
  template <class T>
  T quotient(T rho_old, T rho_new) const {
    const T lower = elementary::min(rho_old, rho_new), upper = elementary::max(rho_old, rho_new);
    T result = potential_.quotient(lower, upper) - slope_ - half_curvature_ * ((lower - cutoff2_) + (upper - cutoff2_));
    const auto across = !(upper < cutoff2_);
    if (elementary::any(across)) {
      const T leaving = lower < cutoff2_ ? -value(lower) / (upper - lower) : all<T>(0);
      result = across ? leaving : result;
    }
    return result;
  }

 private:
  P potential_;
  double cutoff2_;             ///< ρ_c [length²]
  double slope_ = 0;           ///< c₁
  double half_curvature_ = 0;  ///< ½ c₂
};

}  // namespace carom
