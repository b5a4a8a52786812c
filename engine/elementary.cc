// Method, the same for all: reduce the argument to a short interval, keep what rounding loses in a second double, and
// sum the Taylor series there (exp: |r| ≤ ln 2 / 2; log: 2 artanh s, |s| ≤ 0.172). Muller, Elementary Functions, 3rd
// ed., chapters 5 and 11; error-free sums and products: Dekker, Numer. Math. 18 (1971) 224.

#include "engine/elementary.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace carom::elementary {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kLog2e = 0x1.71547652b82fep+0;
constexpr double kLn2Hi = 0x1.62e42fefa2000p-1;  // 40 bits: its product with any exponent is exact
constexpr double kLn2Lo = 0x1.9ef35793c7673p-41;

/// hi + lo, with |lo| at most about half an ulp of hi.
struct Sum {
  double hi, lo;
};

Sum two_sum(double a, double b) {
  const double s = a + b;
  const double b_part = s - a;
  return {s, (a - (s - b_part)) + (b - b_part)};
}

Sum split(double a) {
  const double c = 0x1.0000002p+27 * a;
  const double hi = c - (c - a);
  return {hi, a - hi};
}

Sum two_product(double a, double b) {
  const double p = a * b;
  const Sum x = split(a), y = split(b);
  return {p, ((x.hi * y.hi - p) + x.hi * y.lo + x.lo * y.hi) + x.lo * y.lo};
}

double nearest_integer(double x) { return (x + 0x1.8p52) - 0x1.8p52; }

double power_of_two(int k) { return std::bit_cast<double>(static_cast<std::uint64_t>(k + 1023) << 52); }  // −1022…1023

/// x 2^k for −1132 ≤ k ≤ 1024 and 2^-10 < x < 2: one rounding, in the last multiplication.
double scale(double x, int k) {
  if (k > 1023) return x * power_of_two(k - 1) * 2;
  if (k < -1022) return x * power_of_two(k + 110) * 0x1p-110;
  return x * power_of_two(k);
}

/// e^r − 1 as hi + lo for |r.hi| ≤ 0.35: Taylor series to r^14.
Sum expm1_reduced(Sum r) {
  const double x = r.hi, x2 = x * x, x4 = x2 * x2;
  const double low = (1.0 / 6 + x * (1.0 / 24)) + x2 * (1.0 / 120 + x * (1.0 / 720));
  const double middle = (1.0 / 5040 + x * (1.0 / 40320)) + x2 * (1.0 / 362880 + x * (1.0 / 3628800));
  const double high = (1.0 / 39916800 + x * (1.0 / 479001600)) + x2 * (1.0 / 6227020800 + x * (1.0 / 87178291200));
  const double cubic = x2 * x * (low + x4 * (middle + x4 * high));
  const Sum sum = two_sum(x, 0.5 * x2);
  return {sum.hi, sum.lo + (cubic + (r.lo + x * r.lo))};
}

struct Reduced {
  Sum r;  ///< x = k ln 2 + r
  int k;
};

Reduced reduce(double hi, double lo) {
  const double k = nearest_integer(hi * kLog2e);
  return {two_sum(hi - k * kLn2Hi, lo - k * kLn2Lo), static_cast<int>(k)};
}

/// e^(hi + lo) = mantissa · 2^k, for |hi| < 1100.
struct Scaled {
  Sum mantissa;
  int k;
};

Scaled exp_scaled(double hi, double lo) {
  const Reduced x = reduce(hi, lo);
  const Sum e = expm1_reduced(x.r);
  const Sum one = two_sum(1, e.hi);
  return {{one.hi, one.lo + e.lo}, x.k};
}

double exp_sum(double hi, double lo) {
  if (!(hi < 710)) return hi + lo + (hi > 0 ? kInfinity : 0.0);
  if (hi < -746) return 0;
  const Scaled e = exp_scaled(hi, lo);
  return scale(e.mantissa.hi + e.mantissa.lo, e.k);
}

struct Split {
  double mantissa;  ///< in [√½, √2)
  int exponent;
};

/// Positive, finite x = mantissa · 2^exponent.
Split split_exponent(double x) {
  int exponent = 0;
  if (x < 0x1p-1022) {
    x *= 0x1p54;
    exponent = -54;
  }
  auto bits = std::bit_cast<std::uint64_t>(x);
  exponent += static_cast<int>(bits >> 52) - 1023;
  bits = (bits & 0xfffffffffffffu) | 0x3ff0000000000000u;
  double mantissa = std::bit_cast<double>(bits);
  if (mantissa > 0x1.6a09e667f3bcdp+0) {
    mantissa *= 0.5;
    ++exponent;
  }
  return {mantissa, exponent};
}

/// Σ_{k≥1} 2 z^k/(2k + 1) for z = s² ≤ 0.0295, so that log((1 + s)/(1 − s)) = 2s + s·(this).
double artanh_tail(double z) {
  const double z2 = z * z, z4 = z2 * z2;
  const double low = (2.0 / 3 + z * (2.0 / 5)) + z2 * (2.0 / 7 + z * (2.0 / 9));
  const double high = (2.0 / 11 + z * (2.0 / 13)) + z2 * (2.0 / 15 + z * (2.0 / 17));
  return z * (low + z4 * (high + z4 * ((2.0 / 19 + z * (2.0 / 21)) + z2 * (2.0 / 23))));
}

/// log x as hi + lo with an absolute error of about 2^-60, for positive, finite x.
Sum log_sum(double x) {
  const Split part = split_exponent(x);
  const double f = part.mantissa - 1;  // exact
  const Sum divisor = two_sum(2, f);
  const double s = f / divisor.hi;
  const Sum product = two_product(s, divisor.hi);
  const double s_lo = (((f - product.hi) - product.lo) - s * divisor.lo) / divisor.hi;
  const double k = part.exponent;
  const Sum head = two_sum(k * kLn2Hi, 2 * s);
  return two_sum(head.hi, head.lo + (2 * s_lo + (s * artanh_tail(s * s) + k * kLn2Lo)));
}

/// (1 + 2x) e^(x²) erfc(x) for x ≥ 0 as a polynomial in t = (x − 3.75)/(x + 3.75), from its Chebyshev series of degree
/// 24 (truncated below 2^-57). The form is that of Shepherd and Laframboise, Math. Comp. 36 (1981) 249; the
/// coefficients were computed anew with 60 digits.
constexpr std::array<double, 25> kErfcx = {
    0x1.3ccda0b5d5dc2p+0,  -0x1.1f367683f89a5p-3,  0x1.d5f294815a405p-9,   0x1.510169d09665bp-4,
    -0x1.bda9309a2949ap-4, 0x1.7a14188a9ce2ap-4,   -0x1.e0d0fa6ddfe85p-5,  0x1.d0b0037d167adp-6,
    -0x1.3f603c398c6c5p-7, 0x1.cc3a0e7d2150cp-10,  0x1.33fb2968decd9p-12,  -0x1.303fa4966bc38p-12,
    0x1.b1439865f8d9ep-15, 0x1.778b933adcce7p-16,  -0x1.800077b775cf3p-17, -0x1.055686d42aa63p-20,
    0x1.d6339f66a50f8p-20, -0x1.eb803840c0574p-25, -0x1.15be4201dc721p-22, 0x1.8fa9fe49c359bp-26,
    0x1.4c37f59c36e71p-25, -0x1.014cd7201b5adp-28, -0x1.638dcc665be8dp-28, 0x1.561b105822235p-32,
    0x1.d3744857e262bp-32};

/// erf x for |x| ≤ ½ by its Taylor series, 2/√π Σ (−1)^n x^(2n+1)/(n! (2n + 1)).
double erf_small(double x) {
  constexpr std::array<double, 13> term = {
      1.0,          -1.0 / 3,     1.0 / 10,       -1.0 / 42,      1.0 / 216,        -1.0 / 1320,      1.0 / 9360,
      -1.0 / 75600, 1.0 / 685440, -1.0 / 6894720, 1.0 / 76204800, -1.0 / 918086400, 1.0 / 11975040000};
  constexpr double kTwoOverRootPi = 0x1.20dd750429b6dp+0;
  const double x2 = x * x;
  double sum = term[12];
  for (int n = 11; n >= 0; --n) sum = sum * x2 + term[n];
  return kTwoOverRootPi * x * sum;
}

double erfc_positive(double x) {
  const double t = (x - 3.75) / (x + 3.75), t2 = t * t;
  double even = kErfcx[24], odd = kErfcx[23];
  for (int n = 22; n >= 2; n -= 2) even = even * t2 + kErfcx[n];
  for (int n = 21; n >= 1; n -= 2) odd = odd * t2 + kErfcx[n];
  constexpr double kErfcx0Lo = 0x1.dbcc7ebeaceffp-54;
  const Sum f = two_sum(kErfcx[0], t * odd + t2 * even);
  const Sum divisor = two_sum(1, 2 * x);
  const double q = f.hi / divisor.hi;
  const Sum product = two_product(q, divisor.hi);
  const double q_lo = (((f.hi - product.hi) - product.lo) + (f.lo + kErfcx0Lo) - q * divisor.lo) / divisor.hi;
  const Sum square = two_product(x, x);
  const Scaled e = exp_scaled(-square.hi, -square.lo);
  const Sum result = two_product(e.mantissa.hi, q);
  return scale(result.hi + (result.lo + (e.mantissa.hi * q_lo + e.mantissa.lo * q)), e.k);
}

}  // namespace

double exp(double x) { return exp_sum(x, 0); }

double expm1(double x) {
  if (!(x < 710)) return x + (x > 0 ? kInfinity : 0.0);
  if (x < -40) return -1;
  if (x == 0) return x;
  const Reduced reduced = reduce(x, 0);
  const Sum e = expm1_reduced(reduced.r);
  const int k = reduced.k;
  if (k == 0) return e.hi + e.lo;
  if (k > 60) return scale(e.hi + e.lo + 1, k);
  const Sum shifted = two_sum(1 - power_of_two(-k), e.hi);  // 2^k e^r − 1 = 2^k ((1 − 2^-k) + (e^r − 1))
  const double lost = k > 53 ? -power_of_two(-k) : 0;       // of 1 − 2^-k
  return scale(shifted.hi + (shifted.lo + e.lo + lost), k);
}

double log(double x) {
  if (!(x > 0)) return x == 0 ? -kInfinity : kNaN;
  if (x == kInfinity) return x;
  return log_sum(x).hi;
}

double log1p(double x) {
  if (!(x > -1)) return x == -1 ? -kInfinity : kNaN;
  if (x == kInfinity || x == 0) return x;
  const Sum u = two_sum(1, x);
  const Split part = split_exponent(u.hi);
  const double k = part.exponent;
  const double f = part.mantissa - 1;
  const double s = f / (2 + f);
  // log m = f − s (f − tail), because 2 s = f − s f; what 1 + x lost counts as lo/u
  const double correction = k * kLn2Lo + u.lo / u.hi;
  return k * kLn2Hi + (f - (s * (f - artanh_tail(s * s)) - correction));
}

double pow(double x, double y) {
  if (y == 0 || x == 1) return 1;
  if (!(x > 0) || x == kInfinity || !std::isfinite(y)) {
    if (x != x || y != y || x < 0) return kNaN;
    return (x > 1) == (y > 0) ? kInfinity : 0.0;
  }
  const Sum log_x = log_sum(x);
  if (std::abs(y) > 0x1p70) return (log_x.hi > 0) == (y > 0) ? kInfinity : 0.0;
  const Sum product = two_product(y, log_x.hi);
  return exp_sum(product.hi, product.lo + y * log_x.lo);
}

double erfc(double x) {
  if (x != x) return x;
  if (std::abs(x) < 0.45) return 1 - erf_small(x);
  if (x < 0) return x < -6.5 ? 2.0 : 2 - erfc_positive(-x);
  return x > 28 ? 0.0 : erfc_positive(x);
}

}  // namespace carom::elementary
