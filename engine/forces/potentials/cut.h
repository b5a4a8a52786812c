// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "engine/forces/potentials/potential.h"

namespace carom {

/// The ways in which a potential can end at its cutoff.
enum class CutKind {
  switched,       ///< V up to ρ_s; beyond, V, V′ and V″ go to zero smoothly: integrators keep their order
  shifted,        ///< V(ρ_c) is subtracted: the force jumps, which reduces the order of time-stepping methods
  force_shifted,  ///< a function linear in r is subtracted, so that V and the force go to zero; V″ jumps
  quadratic       ///< a polynomial in ρ is subtracted everywhere, so that V, V′ and V″ go to zero
};

/// A potential cut off at ρ_c, with its quotient in closed form.
///
/// switched: W = V S, where S(ρ) = t³ (10 − 15 t + 6 t²), t = (ρ_c − ρ)/(ρ_c − ρ_s), between ρ_s and ρ_c, 1 below and 0
/// above (C²). With b, a the smaller and the larger argument, and b̄, ā their projections onto [ρ_s, ρ_c]:
///
///   (W(a) − W(b))/(a − b) = V(b) Q_S + S(a) Q,   Q the quotient of V
///   Q_S = −30/(ρ_c − ρ_s) [m² n² + d² (1 − 6 m n)/3 + d⁴/5] (ā − b̄)/(a − b),   n the mean of t at ā and b̄,
///   m = 1 − n,   d half their difference
///
/// The bracket is the mean of t² (1 − t)² over [b̄, ā], so pairs that cross ρ_s or ρ_c need no special case.
///
/// Other kinds: W(ρ) = V(ρ) − V(ρ_c) − c₁ (ρ − ρ_c) − ½ c₂ (ρ − ρ_c)² − F (r − r_c), 0 beyond ρ_c
///
///   shifted: c₁ = c₂ = F = 0;   force-shifted: F = dV/dr at r_c;   quadratic: c₁ = V′(ρ_c), c₂ = V″(ρ_c), F = 0
///   (W(a) − W(b))/(a − b) = [Q(b̄, ā) − c₁ − ½ c₂ ((ā − ρ_c) + (b̄ − ρ_c)) − F/(√ā + √b̄)] (ā − b̄)/(a − b),
///   ā, b̄ at most ρ_c
///
/// Errors: as for V; for S and Q_S up to 8 ε more; for the other kinds a few ε of the terms; their differences go to
/// zero at the cutoff. Sources: Toxvaerd, Dyre, J. Chem. Phys. 134 (2011) 081102 (shifted forces); Steinbach, Brooks,
/// J. Comput. Chem. 15 (1994) 667 (switching).
template <Potential P>
class Cut {
 public:
  /// `switch_from` [length] is used only if switched; 0 < switch_from < cutoff.
  Cut(P potential, double cutoff, CutKind kind, double switch_from = 0)
      : potential_(potential),
        switched_(kind == CutKind::switched),
        bent_(kind == CutKind::quadratic),
        cutoff_(cutoff),
        cutoff2_(cutoff * cutoff),
        at_cutoff_(potential_.value(cutoff2_)) {
    if (switched_) {
      from2_ = switch_from * switch_from;
      inverse_width_ = 1 / (cutoff2_ - from2_);
    }
    if (kind == CutKind::force_shifted) slope_in_r_ = 2 * cutoff * potential_.derivative(cutoff2_);
    if (bent_) {
      slope_ = potential_.derivative(cutoff2_);
      half_curvature_ = 0.5 * potential_.second_derivative(cutoff2_);
    }
  }

  double cutoff_squared() const { return cutoff2_; }
  /// V without the cutoff.
  const P& whole() const { return potential_; }
  bool switched() const { return switched_; }
  /// ρ_s, where a switched potential begins to differ from V [length²].
  double switch_from_squared() const { return from2_; }

  template <class T>
  T value(T rho) const {
    if (switched_) return potential_.value(rho) * factor(rho);
    T value = potential_.value(rho) - at_cutoff_;
    if (bent_) value -= (rho - cutoff2_) * (slope_ + half_curvature_ * (rho - cutoff2_));
    if (slope_in_r_ != 0) value -= slope_in_r_ * (elementary::sqrt(rho) - cutoff_);
    return rho < cutoff2_ ? value : all<T>(0);
  }
  template <class T>
  T derivative(T rho) const {
    if (switched_) {
      const T t = t_of(rho), u = one_minus_t(rho);
      return potential_.derivative(rho) * factor(rho) - potential_.value(rho) * (30 * inverse_width_) * (t * t * u * u);
    }
    T slope = potential_.derivative(rho);
    if (bent_) slope = slope - slope_ - 2 * half_curvature_ * (rho - cutoff2_);
    if (slope_in_r_ != 0) slope -= 0.5 * slope_in_r_ / elementary::sqrt(rho);
    return rho < cutoff2_ ? slope : all<T>(0);
  }
  template <class T>
  T second_derivative(T rho) const {
    if (switched_) {
      const T t = t_of(rho), u = one_minus_t(rho), w = all<T>(60 * inverse_width_);
      return potential_.second_derivative(rho) * factor(rho) - potential_.derivative(rho) * w * (t * t * u * u) +
             potential_.value(rho) * (w * inverse_width_) * (t * u * (u - t));
    }
    T curvature = potential_.second_derivative(rho) - 2 * half_curvature_;
    if (slope_in_r_ != 0) curvature += 0.25 * slope_in_r_ / (rho * elementary::sqrt(rho));
    return rho < cutoff2_ ? curvature : all<T>(0);
  }
  template <class T>
  T quotient(T rho_old, T rho_new) const {
    const T lower = elementary::min(rho_old, rho_new), upper = elementary::max(rho_old, rho_new);
    if (switched_) {
      const T quotient = potential_.quotient(lower, upper);
      if (!elementary::any(upper > from2_)) return quotient;
      return potential_.value(lower) * factor_quotient(lower, upper) + factor(upper) * quotient;
    }
    const T from = at_most_cutoff(lower), to = at_most_cutoff(upper);
    const T quotient = taken_off_quotient(from, to) * part(to - from, upper - lower);
    return lower < cutoff2_ ? quotient : all<T>(0);
  }

 private:
  template <class T>
  T within_switch(T rho) const {
    return at_most_cutoff(elementary::max(rho, all<T>(from2_)));
  }
  template <class T>
  T at_most_cutoff(T rho) const {
    return elementary::min(rho, all<T>(cutoff2_));
  }
  /// numerator/denominator; 1 if both ends coincide.
  template <class T>
  static T part(T numerator, T denominator) {
    return denominator > 0 ? numerator / denominator : all<T>(1);
  }

  /// t, exactly 1 below ρ_s and exactly 0 beyond ρ_c.
  template <class T>
  T t_of(T rho) const {
    const T t = (cutoff2_ - rho) * inverse_width_;
    return rho <= from2_ ? all<T>(1) : rho < cutoff2_ ? t : all<T>(0);
  }
  /// 1 − t, exactly 0 below ρ_s and exactly 1 beyond ρ_c.
  template <class T>
  T one_minus_t(T rho) const {
    const T u = (rho - from2_) * inverse_width_;
    return rho >= cutoff2_ ? all<T>(1) : rho > from2_ ? u : all<T>(0);
  }
  /// S
  template <class T>
  T factor(T rho) const {
    const T t = t_of(rho);
    return t * t * t * (10 - t * (15 - 6 * t));
  }
  /// Q_S
  template <class T>
  T factor_quotient(T lower, T upper) const {
    const T from = within_switch(lower), to = within_switch(upper);
    const T m = 0.5 * (one_minus_t(from) + one_minus_t(to)), n = 0.5 * (t_of(from) + t_of(to));
    const T d = 0.5 * inverse_width_ * (to - from), d2 = d * d, mn = m * n;
    const T mean = mn * mn + d2 * ((1 - 6 * mn) * (1.0 / 3) + 0.2 * d2);
    return (-30 * inverse_width_) * mean * part(to - from, upper - lower);
  }
  template <class T>
  T taken_off_quotient(T from, T to) const {
    T quotient = potential_.quotient(from, to);
    if (bent_) quotient = quotient - slope_ - half_curvature_ * ((from - cutoff2_) + (to - cutoff2_));
    if (slope_in_r_ != 0) quotient -= slope_in_r_ / (elementary::sqrt(from) + elementary::sqrt(to));
    return quotient;
  }

  P potential_;
  bool switched_, bent_;       ///< bent_: the kind is quadratic
  double cutoff_, cutoff2_;    ///< r_c [length], ρ_c [length²]
  double at_cutoff_;           ///< V(ρ_c)
  double from2_ = 0;           ///< ρ_s [length²]
  double inverse_width_ = 0;   ///< 1/(ρ_c − ρ_s)
  double slope_ = 0;           ///< c₁
  double half_curvature_ = 0;  ///< ½ c₂
  double slope_in_r_ = 0;      ///< F
};

}  // namespace carom
