// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/forces/potentials/potential.h"

namespace carom {

/// The pair term of an Ewald sum for unit charges, up to r = `end`:
///
///   V(r) = C [1/r − α E(α²ρ)],   E(u) = erf(√u)/√u = (2/√π) ∫₀¹ e^(−uτ²) dτ,
///
/// where a polynomial in t = 2ρ/end² − 1 stands for the entire function E: the Chebyshev series of E over the range,
/// without its last terms. Its derivative and quotient are those of the polynomial, so energies are exact whatever its
/// degree;
///
///   (p(b) − p(a))/(b − a) = q₀,   q_k = q_{k+1} b + p_{k+1},   p_k = p_{k+1} a + c_k   (Horner's scheme and its
///   quotient).
///
/// With h = ½ (α end)² and J_n = (2/√π) ∫₀¹ τ^(2n) e^(−hτ²) dτ the coefficients of t^n and of the Chebyshev polynomial
/// T_n in E are
///
///   (−h)^n/n! J_n   and   2 (−1)^n Σ_m (h/2)^(2m+n)/(m! (m + n)!) J_{2m+n}   (n > 0).
///
/// Errors: a few ε of C/r, besides those of the terms left out.
class EwaldPair {
 public:
  /// `error`: the largest error of dE/du.
  EwaldPair(double constant, double alpha, double end, double error);

  ForceScale scale(double distance) const {
    const double near = std::min(distance, 1 / alpha_), energy = 0.125 * std::abs(c_) / near;
    return {2 * energy / near, energy};  // V(1/α) = 0.157 Cα; the force there is 0.57 Cα²
  }

  template <class T>
  T value(T rho) const {
    return c_ / elementary::sqrt(rho) - polynomial(term_, rho);
  }
  template <class T>
  T derivative(T rho) const {
    return -0.5 * c_ / (rho * elementary::sqrt(rho)) - polynomial(first_, rho);
  }
  template <class T>
  T second_derivative(T rho) const {
    return 0.75 * c_ / (rho * rho * elementary::sqrt(rho)) - polynomial(second_, rho);
  }
  template <class T>
  T quotient(T rho_old, T rho_new) const {
    const T lower = elementary::min(elementary::min(rho_old, rho_new), all<T>(end2_));
    const T upper = elementary::min(elementary::max(rho_old, rho_new), all<T>(end2_));
    const T r = elementary::sqrt(lower), s = elementary::sqrt(upper);
    const T a = slope_ * lower - 1, b = slope_ * upper - 1;
    T p = all<T>(term_[degree_]), q = all<T>(0);
    for (std::size_t k = degree_; k-- > 0;) {
      q = q * b + p;
      p = p * a + term_[k];
    }
    return -c_ / (r * s * (r + s)) - slope_ * q;
  }

 private:
  static constexpr std::size_t kMostTerms = 64;
  using Terms = std::array<double, kMostTerms + 1>;  // by the power of t

  /// Even and odd powers apart, because a sum has to wait for the one before.
  template <class T>
  T polynomial(const Terms& terms, T rho) const {
    const T t = slope_ * elementary::min(rho, all<T>(end2_)) - 1, t2 = t * t;
    std::size_t k = degree_ / 2 * 2;
    T even = all<T>(terms[k]), odd = all<T>(terms[k + 1]);
    for (; k > 0; k -= 2) {
      even = even * t2 + terms[k - 2];
      odd = odd * t2 + terms[k - 1];
    }
    return even + odd * t;
  }

  double c_;             ///< [energy·length] for unit charges
  double alpha_;         ///< [1/length]
  double end2_, slope_;  ///< [length²], [1/length²]
  std::size_t degree_ = 0;
  Terms term_{}, first_{}, second_{};  ///< of the polynomial in V [energy], dV/dρ and d²V/dρ²
};

static_assert(Potential<EwaldPair>);

}  // namespace carom
