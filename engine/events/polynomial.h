// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The first time at which a polynomial falls through zero, guaranteed: no root is missed or found twice.
//
// The gap between two spheres on parabolas is a quartic of time; a contact is the first instant at which the gap is not
// positive *and falling*. Between neighbouring zeros of its derivative a polynomial is monotone, so a sign change there
// is one root and the lack of one is none. The zeros of the derivative are found in the same way from the derivative of
// the derivative, down to the quadratic. (Collins and Loos, Real zeros of polynomials, 1982, section 3.)

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace carom {

inline constexpr double kNever = std::numeric_limits<double>::infinity();

/// c[0] + c[1] s + … + c[N] s^N.
template <int N>
struct Polynomial {
  std::array<double, N + 1> c;

  double operator()(double s) const {
    double value = c[N];
    for (int k = N - 1; k >= 0; --k) value = value * s + c[k];
    return value;
  }
  Polynomial<N - 1> derivative() const {
    Polynomial<N - 1> d;
    for (int k = 1; k <= N; ++k) d.c[k - 1] = k * c[k];
    return d;
  }
};

/// At most N numbers in ascending order.
template <int N>
struct Roots {
  std::array<double, N> at;
  int count = 0;
  void push(double s) { at[count++] = s; }
  const double* begin() const { return at.data(); }
  const double* end() const { return at.data() + count; }
};

/// The single sign change between lo and hi of a polynomial, or any function with a derivative, by Newton's method in a
/// shrinking bracket, to the last bit.
template <class F, class DF>
double bracketed_root(const F& f, const DF& df, double lo, double hi) {
  const bool rising = f(lo) < 0;
  double s = 0.5 * (lo + hi);
  for (int iteration = 0; iteration < 200; ++iteration) {
    const double value = f(s);
    if (value == 0) return s;
    ((value < 0) == rising ? lo : hi) = s;
    double next = s - value / df(s);
    if (!(next > lo && next < hi)) next = 0.5 * (lo + hi);
    if (next == s || next <= lo || next >= hi) return s;
    s = next;
  }
  return s;
}

/// The zeros in the open interval (0, end) at which p changes sign, ascending.
template <int N>
Roots<N> sign_changes(const Polynomial<N>& p, double end) {
  Roots<N> roots;
  if constexpr (N == 1) {
    const double s = -p.c[0] / p.c[1];
    if (s > 0 && s < end) roots.push(s);
  } else if constexpr (N == 2) {
    const double discriminant = p.c[1] * p.c[1] - 4 * p.c[2] * p.c[0];
    if (!(discriminant > 0)) return roots;
    const double q = -0.5 * (p.c[1] + std::copysign(std::sqrt(discriminant), p.c[1]));
    const double s1 = q / p.c[2], s2 = p.c[0] / q;  // an infinite or NaN root fails both comparisons below
    for (double s : {std::fmin(s1, s2), std::fmax(s1, s2)})
      if (s > 0 && s < end && (roots.count == 0 || s > roots.at[0])) roots.push(s);
  } else {
    const auto d = p.derivative();
    double left = 0;
    auto look = [&](double right) {
      const double at_left = p(left), at_right = p(right);
      if ((at_left < 0) != (at_right < 0) && at_left != 0) roots.push(bracketed_root(p, d, left, right));
      left = right;
    };
    for (double s : sign_changes(d, end)) look(s);
    look(end);
  }
  return roots;
}

/// The first s in [0, end) with p(s) ≤ 0 and p falling there; kNever if there is none.
template <int N>
double first_fall(const Polynomial<N>& p, double end) {
  const auto d = p.derivative();
  double left = 0, at_left = p(0.0);
  auto look = [&](double right) {
    const double at_right = p(right);
    double found = kNever;
    if (at_right < at_left) {
      if (at_left <= 0)
        found = left;
      else if (at_right <= 0)
        found = bracketed_root(p, d, left, right);
    }
    left = right;
    at_left = at_right;
    return found;
  };
  for (double s : sign_changes(d, end))
    if (const double found = look(s); found < kNever) return found;
  const double found = look(end);
  return found < end ? found : kNever;
}

}  // namespace carom
