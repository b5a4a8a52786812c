// SPDX-License-Identifier: BSD-3-Clause
// A number here is an unevaluated sum of two doubles, accurate to about 100 bits; series are summed to about 72. Each
// step is then rounded to 64 bits, as the x87 unit did in earlier versions, so that a seed still gives the same
// velocities.
#include "engine/base/normal_deviates.h"

#include <cmath>

#include "engine/base/elementary_lanes.h"

namespace carom {
namespace {

using Number = elementary::formula::Sum<double>;
using elementary::formula::two_product;
using elementary::formula::two_sum;

constexpr Number operator+(Number a, Number b) {
  const Number s = two_sum(a.hi, b.hi);
  return two_sum(s.hi, s.lo + (a.lo + b.lo));
}
constexpr Number operator*(Number a, Number b) {
  const Number p = two_product(a.hi, b.hi);
  return two_sum(p.hi, p.lo + (a.hi * b.lo + a.lo * b.hi));
}
constexpr Number operator-(Number a) { return {-a.hi, -a.lo}; }
constexpr Number operator/(Number a, Number b) {
  const double q = a.hi / b.hi;
  const Number rest = a + -(Number{q, 0} * b);
  return two_sum(q, rest.hi / b.hi);
}
Number square_root(Number a) {
  const double root = std::sqrt(a.hi);
  return two_sum(root, (a + -two_product(root, root)).hi / (2 * root));
}

/// Rounds to the nearest number of 64 bits.
Number rounded(Number x) {
  const auto exponent = __builtin_bit_cast(unsigned long long, x.hi) & 0x7ff0000000000000ULL;
  const double grid = 0x1.8p-11 * __builtin_bit_cast(double, exponent);  // its last bit is 2^-63 of the power of two
  return two_sum(x.hi, (x.lo + grid) - grid);
}

/// A power series to z^(N − 1); `coefficient(k)` is the coefficient of z^k.
template <int N>
struct Series {
  Number c[N];
  constexpr explicit Series(auto coefficient) {
    for (int k = 0; k < N; ++k) c[k] = coefficient(k);
  }
  /// The sum for |z| ≤ 0.617: the lower half of a number changes the terms from z^4 on by less than 2^-71.
  Number at(Number z) const {
    double high = c[N - 1].hi;
    for (int k = N - 2; k > 3; --k) high = high * z.hi + c[k].hi;
    Number sum{high, 0};
    for (int k = 3; k >= 0; --k) sum = sum * z + c[k];
    return sum;
  }
};

constexpr Number inverse_factorial(int n) {  // with the sign of the series of sine and cosine
  Number product{1, 0};
  for (int k = 2; k <= n; ++k) product = product * Number{k % 2 == 0 ? -double(k) : double(k), 0};
  return Number{1, 0} / product;
}
constexpr Series<15> kArtanh([](int k) { return Number{2, 0} / Number{2 * k + 1.0, 0}; });  // 2 artanh(s)/s of s²
constexpr Series<12> kSine([](int k) { return inverse_factorial(2 * k + 1); });             // sin(r)/r of r²
constexpr Series<12> kCosine([](int k) { return inverse_factorial(2 * k); });               // cos(r) of r²
constexpr Number kLn2{0x1.62e42fefa39efp-1, 0x1.abc9e3b39803fp-56};
constexpr Number kHalfPi{0x1.921fb54442d18p+0, 0x1.1a62633145c07p-54};
constexpr Number kTwoPi{0x1.921fb54442d18p+2, 0x1.1a8p-52};  // rounded to 64 bits

/// log u for a positive, normal u. u = m 2^k with m in [√½, √2), and log m = 2 artanh((m − 1)/(m + 1)).
Number logarithm(double u) {
  const auto [m, k] = elementary::formula::split_exponent(u);
  const Number s = Number{m - 1, 0} / two_sum(m, 1.0);
  return kLn2 * Number{k, 0} + s * kArtanh.at(s * s);
}

/// The cosine and the sine of 2π·turn for turns in [0, 1).
std::array<Number, 2> on_circle(double turn) {
  const Number angle = rounded(kTwoPi * Number{turn, 0});
  const int quadrant = static_cast<int>(std::floor(4 * turn + 0.5));
  const Number r = angle + -(kHalfPi * Number{static_cast<double>(quadrant), 0}), squared = r * r;
  const Number sine = r * kSine.at(squared), cosine = kCosine.at(squared);
  const Number x = quadrant % 2 == 0 ? cosine : sine, y = quadrant % 2 == 0 ? sine : cosine;
  const Number cos = quadrant == 1 || quadrant == 2 ? -x : x, sin = quadrant == 2 || quadrant == 3 ? -y : y;
  return {cos, sin};
}

}  // namespace

std::array<double, 2> normal_deviates(double u, double turn) {
  const Number length = rounded(square_root(Number{-2, 0} * rounded(logarithm(u))));
  const auto [cos, sin] = on_circle(turn);
  return {rounded(length * rounded(cos)).hi, rounded(length * rounded(sin)).hi};
}

std::array<double, 2> cosine_and_sine(double turn) {
  const auto [cos, sin] = on_circle(turn - std::floor(turn));
  return {cos.hi, sin.hi};
}

}  // namespace carom
