// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The formulas of elementary.h, for a double or for the lanes of a vector: no branch depends on a lane.
//
// All functions use the same method: reduce the argument to a short interval, keep the rounding error in a second
// double, and sum the Taylor series there (exp: |r| ≤ ln 2 / 2; log: 2 artanh s, |s| ≤ 0.172). Muller, Elementary
// Functions, 3rd ed., chapters 5 and 11; error-free sums and products: Dekker, Numer. Math. 18 (1971) 224.

#include "engine/base/lanes.h"

namespace carom::elementary::formula {

inline constexpr double kInfinity = __builtin_inf();
inline constexpr double kNaN = __builtin_nan("");
inline constexpr double kLog2e = 0x1.71547652b82fep+0;
inline constexpr double kLn2Hi = 0x1.62e42fefa2000p-1;  // 40 bits, so that its product with any exponent is exact
inline constexpr double kLn2Lo = 0x1.9ef35793c7673p-41;

template <class T>
concept Number = std::same_as<T, double> || Lanes<T>;

/// hi + lo, with |lo| at most about half an ulp of hi.
template <class T>
struct Sum {
  T hi, lo;
};

template <class T>
[[gnu::always_inline]] constexpr Sum<T> two_sum(T a, T b) {
  const T s = a + b;
  const T b_part = s - a;
  return {s, (a - (s - b_part)) + (b - b_part)};
}

template <class T>
[[gnu::always_inline]] constexpr Sum<T> split(T a) {
  const T c = 0x1.0000002p+27 * a;
  const T hi = c - (c - a);
  return {hi, a - hi};
}

template <class T>
[[gnu::always_inline]] constexpr Sum<T> two_product(T a, T b) {
  const T p = a * b;
  const Sum<T> x = split(a), y = split(b);
  return {p, ((x.hi * y.hi - p) + x.hi * y.lo + x.lo * y.hi) + x.lo * y.lo};
}

/// x 2^k for −1132 ≤ k ≤ 1024 and 2^-10 < x < 2. Only the last multiplication rounds.
template <class T>
[[gnu::always_inline]] inline T scale(T x, T k) {
  const T half = nearest_integer(0.5 * k);
  return x * power_of_two(half) * power_of_two(k - half);
}

/// e^r − 1 as hi + lo for |r.hi| ≤ 0.35: Taylor series to r^14.
template <class T>
[[gnu::always_inline]] inline Sum<T> expm1_reduced(Sum<T> r) {
  const T x = r.hi, x2 = x * x, x4 = x2 * x2;
  const T low = (1.0 / 6 + x * (1.0 / 24)) + x2 * (1.0 / 120 + x * (1.0 / 720));
  const T middle = (1.0 / 5040 + x * (1.0 / 40320)) + x2 * (1.0 / 362880 + x * (1.0 / 3628800));
  const T high = (1.0 / 39916800 + x * (1.0 / 479001600)) + x2 * (1.0 / 6227020800 + x * (1.0 / 87178291200));
  const T cubic = x2 * x * (low + x4 * (middle + x4 * high));
  const Sum<T> sum = two_sum(x, 0.5 * x2);
  return {sum.hi, sum.lo + (cubic + (r.lo + x * r.lo))};
}

template <class T>
struct Reduced {
  Sum<T> r;  ///< x = k ln 2 + r
  T k;
};

template <class T>
[[gnu::always_inline]] inline Reduced<T> reduce(T hi, T lo) {
  const T k = nearest_integer(hi * kLog2e);
  return {two_sum(hi - k * kLn2Hi, lo - k * kLn2Lo), k};
}

/// e^(hi + lo) = mantissa · 2^k, for |hi| < 1100.
template <class T>
struct Scaled {
  Sum<T> mantissa;
  T k;
};

template <class T>
[[gnu::always_inline]] inline Scaled<T> exp_scaled(T hi, T lo) {
  const Reduced<T> x = reduce(hi, lo);
  const Sum<T> e = expm1_reduced(x.r);
  const Sum<T> one = two_sum(all<T>(1), e.hi);
  return {{one.hi, one.lo + e.lo}, x.k};
}

template <class T>
[[gnu::always_inline]] inline T exp_sum(T hi, T lo) {
  const T within = hi < 710.0 ? (hi > -746.0 ? hi : all<T>(-746)) : all<T>(0);
  const Scaled<T> e = exp_scaled(within, lo);
  const T result = scale(e.mantissa.hi + e.mantissa.lo, e.k);
  const T beyond = hi > 0.0 ? all<T>(kInfinity) : hi + lo;  // or NaN
  return hi < 710.0 ? (hi < -746.0 ? all<T>(0) : result) : beyond;
}

template <class T>
struct Split {
  T mantissa;  ///< in [√½, √2)
  T exponent;
};

/// Positive, finite x = mantissa · 2^exponent.
template <class T>
[[gnu::always_inline]] inline Split<T> split_exponent(T x) {
  const auto subnormal = x < 0x1p-1022;
  const T normal = subnormal ? x * 0x1p54 : x;
  const auto bits = __builtin_bit_cast(BitsOf<T>, normal);
  const T above = __builtin_bit_cast(T, (bits >> 52) | 0x4330000000000000ULL) - (0x1p52 + 1023);
  const T mantissa = __builtin_bit_cast(T, (bits & 0xfffffffffffffULL) | 0x3ff0000000000000ULL);
  const T exponent = subnormal ? above - 54 : above;
  const auto high = mantissa > 0x1.6a09e667f3bcdp+0;
  return {high ? 0.5 * mantissa : mantissa, high ? exponent + 1 : exponent};
}

/// Σ_{k≥1} 2 z^k/(2k + 1) for z = s² ≤ 0.0295, so that log((1 + s)/(1 − s)) = 2s + s·(this).
template <class T>
[[gnu::always_inline]] inline T artanh_tail(T z) {
  const T z2 = z * z, z4 = z2 * z2;
  const T low = (2.0 / 3 + z * (2.0 / 5)) + z2 * (2.0 / 7 + z * (2.0 / 9));
  const T high = (2.0 / 11 + z * (2.0 / 13)) + z2 * (2.0 / 15 + z * (2.0 / 17));
  return z * (low + z4 * (high + z4 * ((2.0 / 19 + z * (2.0 / 21)) + z2 * (2.0 / 23))));
}

/// log x as hi + lo with an absolute error of about 2^-60, for positive, finite x.
template <class T>
[[gnu::always_inline]] inline Sum<T> log_sum(T x) {
  const Split<T> part = split_exponent(x);
  const T f = part.mantissa - 1;  // exact
  const Sum<T> divisor = two_sum(all<T>(2), f);
  const T s = f / divisor.hi;
  const Sum<T> product = two_product(s, divisor.hi);
  const T s_lo = (((f - product.hi) - product.lo) - s * divisor.lo) / divisor.hi;
  const T k = part.exponent;
  const Sum<T> head = two_sum(k * kLn2Hi, 2 * s);
  return two_sum(head.hi, head.lo + (2 * s_lo + (s * artanh_tail(s * s) + k * kLn2Lo)));
}

/// (1 + 2x) e^(x²) erfc(x) for x ≥ 0 as a polynomial in t = (x − 3.75)/(x + 3.75), from its Chebyshev series of degree
/// 24 (truncated below 2^-57). The form is from Shepherd and Laframboise, Math. Comp. 36 (1981) 249; the coefficients
/// were recomputed with 60 digits.
inline constexpr double kErfcx[25] = {
    0x1.3ccda0b5d5dc2p+0,  -0x1.1f367683f89a5p-3,  0x1.d5f294815a405p-9,   0x1.510169d09665bp-4,
    -0x1.bda9309a2949ap-4, 0x1.7a14188a9ce2ap-4,   -0x1.e0d0fa6ddfe85p-5,  0x1.d0b0037d167adp-6,
    -0x1.3f603c398c6c5p-7, 0x1.cc3a0e7d2150cp-10,  0x1.33fb2968decd9p-12,  -0x1.303fa4966bc38p-12,
    0x1.b1439865f8d9ep-15, 0x1.778b933adcce7p-16,  -0x1.800077b775cf3p-17, -0x1.055686d42aa63p-20,
    0x1.d6339f66a50f8p-20, -0x1.eb803840c0574p-25, -0x1.15be4201dc721p-22, 0x1.8fa9fe49c359bp-26,
    0x1.4c37f59c36e71p-25, -0x1.014cd7201b5adp-28, -0x1.638dcc665be8dp-28, 0x1.561b105822235p-32,
    0x1.d3744857e262bp-32};

/// erf x for |x| ≤ ½ by its Taylor series, 2/√π Σ (−1)^n x^(2n+1)/(n! (2n + 1)).
template <class T>
[[gnu::always_inline]] inline T erf_small(T x) {
  constexpr double term[13] = {
      1.0,          -1.0 / 3,     1.0 / 10,       -1.0 / 42,      1.0 / 216,        -1.0 / 1320,      1.0 / 9360,
      -1.0 / 75600, 1.0 / 685440, -1.0 / 6894720, 1.0 / 76204800, -1.0 / 918086400, 1.0 / 11975040000};
  constexpr double kTwoOverRootPi = 0x1.20dd750429b6dp+0;
  const T x2 = x * x;
  T sum = all<T>(term[12]);
  for (int n = 11; n >= 0; --n) sum = sum * x2 + term[n];
  return kTwoOverRootPi * x * sum;
}

template <class T>
[[gnu::always_inline]] inline T erfc_positive(T x) {
  const T t = (x - 3.75) / (x + 3.75), t2 = t * t;
  T even = all<T>(kErfcx[24]), odd = all<T>(kErfcx[23]);
  for (int n = 22; n >= 2; n -= 2) even = even * t2 + kErfcx[n];
  for (int n = 21; n >= 1; n -= 2) odd = odd * t2 + kErfcx[n];
  constexpr double kErfcx0Lo = 0x1.dbcc7ebeaceffp-54;
  const Sum<T> f = two_sum(all<T>(kErfcx[0]), t * odd + t2 * even);
  const Sum<T> divisor = two_sum(all<T>(1), 2 * x);
  const T q = f.hi / divisor.hi;
  const Sum<T> product = two_product(q, divisor.hi);
  const T q_lo = (((f.hi - product.hi) - product.lo) + (f.lo + kErfcx0Lo) - q * divisor.lo) / divisor.hi;
  const Sum<T> square = two_product(x, x);
  const Scaled<T> e = exp_scaled(-square.hi, -square.lo);
  const Sum<T> result = two_product(e.mantissa.hi, q);
  return scale(result.hi + (result.lo + (e.mantissa.hi * q_lo + e.mantissa.lo * q)), e.k);
}

template <Number T>
[[gnu::always_inline]] inline T exp(T x) {
  return exp_sum(x, all<T>(0));
}

template <Number T>
[[gnu::always_inline]] inline T expm1(T x) {
  const T within = x < 710.0 ? (x > -40.0 ? x : all<T>(-40)) : all<T>(0);
  const Reduced<T> reduced = reduce(within, all<T>(0));
  const Sum<T> e = expm1_reduced(reduced.r);
  const T k = reduced.k;
  const T one = power_of_two(-min(k, all<T>(1000)));  // 2^k e^r − 1 = 2^k ((1 − 2^-k) + (e^r − 1))
  const Sum<T> shifted = two_sum(1 - one, e.hi);
  const T lost = k > 53.0 ? -one : all<T>(0);  // the rounding error of 1 − 2^-k
  const T result = scale(shifted.hi + (shifted.lo + e.lo + lost), k);
  const T beyond = x > 0.0 ? all<T>(kInfinity) : x;  // or NaN
  return x < 710.0 ? (x < -40.0 ? all<T>(-1) : x == 0.0 ? x : result) : beyond;
}

template <Number T>
[[gnu::always_inline]] inline T log(T x) {
  const auto ordinary = (x > 0.0) & (x < kInfinity);
  const T result = log_sum(ordinary ? x : all<T>(1)).hi;
  const T beyond = x == kInfinity ? x : (x == 0.0 ? all<T>(-kInfinity) : all<T>(kNaN));
  return ordinary ? result : beyond;
}

template <Number T>
[[gnu::always_inline]] inline T log1p(T x) {
  const auto ordinary = (x > -1.0) & (x < kInfinity) & (x != 0.0);
  const Sum<T> u = two_sum(all<T>(1), ordinary ? x : all<T>(1));
  const Split<T> part = split_exponent(u.hi);
  const T k = part.exponent;
  const T f = part.mantissa - 1;
  const T s = f / (2 + f);
  // log m = f − s (f − tail), because 2 s = f − s f; lo/u corrects the rounding error of 1 + x
  const T correction = k * kLn2Lo + u.lo / u.hi;
  const T result = k * kLn2Hi + (f - (s * (f - artanh_tail(s * s)) - correction));
  const T beyond = x > -1.0 ? x : (x == -1.0 ? all<T>(-kInfinity) : all<T>(kNaN));
  return ordinary ? result : beyond;
}

/// The exponent is the same in all lanes.
template <Number T>
[[gnu::always_inline]] inline T pow(T x, double y) {
  if (y == 0) return all<T>(1);
  const auto ordinary = (x > 0.0) & (x < kInfinity);
  const Sum<T> log_x = log_sum(ordinary ? x : all<T>(1));
  T result;
  if (!(y < 0x1p70 && y > -0x1p70)) {
    const T grown = all<T>(y > 0 ? kInfinity : 0.0), shrunk = all<T>(y > 0 ? 0.0 : kInfinity);
    result = y == y ? (log_x.hi > 0.0 ? grown : shrunk) : all<T>(kNaN);
  } else {
    const Sum<T> product = two_product(all<T>(y), log_x.hi);
    result = exp_sum(product.hi, product.lo + y * log_x.lo);
  }
  const T infinite = all<T>(y > 0 ? kInfinity : 0.0), zero = all<T>(y > 0 ? 0.0 : kInfinity);
  const T beyond = x == kInfinity ? infinite : (x == 0.0 ? zero : all<T>(kNaN));
  return x == 1.0 ? all<T>(1) : (ordinary ? result : beyond);
}

template <Number T>
[[gnu::always_inline]] inline T erfc(T x) {
  const T size = abs(x);
  const auto small = size < 0.45;
  const T within = size < 28.0 ? size : all<T>(28);
  const T tail = erfc_positive(within);
  T result = x < 0.0 ? 2 - tail : tail;
  result = x > 28.0 ? all<T>(0) : (x < -6.5 ? all<T>(2) : result);
  result = x != x ? x : result;
  return any(small) ? (small ? 1 - erf_small(x) : result) : result;
}

}  // namespace carom::elementary::formula
