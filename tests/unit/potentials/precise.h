// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// 50-digit arithmetic and errors in units in the last place, for the tests in this folder.

#include <boost/multiprecision/cpp_bin_float.hpp>
#include <cmath>
#include <limits>

namespace carom::test {

using Precise = boost::multiprecision::cpp_bin_float_50;

/// |computed − exact| in units of 2^-52·|scale|; a unit is at least the smallest subnormal number.
inline double error_in_epsilons(double computed, const Precise& exact, const Precise& scale) {
  if (!std::isfinite(computed)) return std::numeric_limits<double>::infinity();
  const Precise unit = abs(scale) * Precise(std::numeric_limits<double>::epsilon());
  const Precise smallest(std::numeric_limits<double>::denorm_min());
  return static_cast<double>(abs(Precise(computed) - exact) / (unit > smallest ? unit : smallest));
}

/// |computed − exact| in units in the last place of the exact value, subnormal numbers included.
inline double error_in_ulps(double computed, const Precise& exact) {
  const double rounded = static_cast<double>(exact);
  if (!std::isfinite(rounded)) return computed == rounded ? 0 : std::numeric_limits<double>::infinity();
  int exponent = std::numeric_limits<double>::min_exponent;
  if (rounded != 0) std::frexp(rounded, &exponent);
  exponent = std::max(exponent, std::numeric_limits<double>::min_exponent);
  return static_cast<double>(abs(Precise(computed) - exact) * ldexp(Precise(1), 53 - exponent));
}

}  // namespace carom::test
