// SPDX-License-Identifier: BSD-3-Clause
// The elementary functions against 50-digit arithmetic: errors in ulps over their whole range, and the special cases.

#include "engine/base/elementary.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <boost/math/special_functions/erf.hpp>
#include <boost/math/special_functions/expm1.hpp>
#include <boost/math/special_functions/log1p.hpp>
#include <random>

#include "tests/unit/potentials/precise.h"

namespace carom::elementary_test {
namespace {

using test::error_in_ulps;
using test::Precise;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Uniform in [from, to], and an equal number over all magnitudes up to these ends.
std::vector<double> arguments(double from, double to, int count = 4000) {
  std::mt19937_64 random(20240117);
  std::uniform_real_distribution<double> uniform(from, to), magnitude(-60, 0), sign(-1, 1);
  std::vector<double> x;
  for (int n = 0; n < count; ++n) {
    x.push_back(uniform(random));
    const double end = sign(random) < 0 ? from : to;
    x.push_back(end * std::exp2(magnitude(random)));
  }
  x.insert(x.end(), {from, to});
  return x;
}

template <class Function, class Exact>
double worst_error(const std::vector<double>& arguments, Function function, Exact exact) {
  double worst = 0, where = 0;
  for (const double x : arguments) {
    const double error = error_in_ulps(function(x), exact(Precise(x)));
    if (!(error <= worst)) {
      worst = error;
      where = x;
    }
  }
  ::testing::Test::RecordProperty("worst_ulps", std::to_string(worst));
  std::printf("    largest error %.3f ulp, at %.17g\n", worst, where);
  return worst;
}

template <class Exact>
double worst_error(const std::vector<double>& arguments, double (*function)(double), Exact exact) {
  return worst_error(
      arguments, [function](double x) { return function(x); }, exact);
}

TEST(Elementary, ExpIsWithinAnUlp) {
  const auto exact = [](const Precise& x) { return Precise(boost::multiprecision::exp(x)); };
  EXPECT_LE(worst_error(arguments(-745, 709.7), elementary::exp, exact), 1.0);
  EXPECT_LE(worst_error(arguments(-1, 1), elementary::exp, exact), 1.0);
}

TEST(Elementary, Expm1IsWithinAnUlp) {
  const auto exact = [](const Precise& x) { return boost::math::expm1(x); };
  EXPECT_LE(worst_error(arguments(-50, 709.7), elementary::expm1, exact), 1.0);
  EXPECT_LE(worst_error(arguments(-3, 3), elementary::expm1, exact), 1.0);
  EXPECT_LE(worst_error(arguments(20, 60), elementary::expm1, exact), 1.0);
}

TEST(Elementary, LogIsWithinAnUlp) {
  const auto exact = [](const Precise& x) { return Precise(boost::multiprecision::log(x)); };
  std::vector<double> positive = arguments(0.01, 3);
  for (const double x : arguments(-1020, 1020, 1000)) positive.push_back(std::exp2(x));
  positive.insert(positive.end(), {5e-324, 1e-310, std::nextafter(1.0, 2.0), std::nextafter(1.0, 0.0)});
  EXPECT_LE(worst_error(positive, elementary::log, exact), 1.0);
}

TEST(Elementary, Log1pIsWithinAnUlp) {
  const auto exact = [](const Precise& x) { return boost::math::log1p(x); };
  EXPECT_LE(worst_error(arguments(-0.999999, 3), elementary::log1p, exact), 1.0);
  EXPECT_LE(worst_error(arguments(-0.5, 1e300), elementary::log1p, exact), 1.0);
}

TEST(Elementary, PowKeepsItsDigitsAtLargeExponents) {
  for (const double y : {-50.0, -12.5, -6.0, -0.5, 1.0, 2.25, 9.0, 36.0})
    EXPECT_LE(worst_error(
                  arguments(0.01, 100, 1000), [y](double x) { return elementary::pow(x, y); },
                  [y](const Precise& x) { return Precise(pow(x, Precise(y))); }),
              1.5)
        << "y = " << y;
}

TEST(Elementary, CbrtIsHardlyMoreThanHalfAnUlpOff) {
  std::vector<double> positive = arguments(0.01, 30);
  for (const double x : arguments(-890, 890, 1000)) positive.push_back(std::exp2(x));
  EXPECT_LE(worst_error(positive, elementary::cbrt, [](const Precise& x) { return Precise(cbrt(x)); }), 0.51);
  for (int n = 0; n < 2000; ++n) EXPECT_EQ(elementary::cbrt(static_cast<double>(n) * n * n), n);
}

TEST(Elementary, ErfcIsWithinOnePointTwoUlps) {
  const auto exact = [](const Precise& x) { return boost::math::erfc(x); };
  EXPECT_LE(worst_error(arguments(0, 26.5, 2000), elementary::erfc, exact), 1.2);
  EXPECT_LE(worst_error(arguments(0, 1.5, 2000), elementary::erfc, exact), 1.2);
  EXPECT_LE(worst_error(arguments(-7, 0, 500), elementary::erfc, exact), 1.2);
  EXPECT_LE(worst_error(arguments(26.5, 28, 200), elementary::erfc, exact), 1.2);
}

TEST(Elementary, SpecialCases) {
  EXPECT_EQ(elementary::exp(0), 1);
  EXPECT_EQ(elementary::exp(-800), 0);
  EXPECT_EQ(elementary::exp(-kInfinity), 0);
  EXPECT_EQ(elementary::exp(709.9), kInfinity);
  EXPECT_EQ(elementary::exp(kInfinity), kInfinity);
  EXPECT_EQ(elementary::expm1(0), 0);
  EXPECT_TRUE(std::signbit(elementary::expm1(-0.0)));
  EXPECT_EQ(elementary::expm1(-100), -1);
  EXPECT_EQ(elementary::expm1(-kInfinity), -1);
  EXPECT_EQ(elementary::expm1(kInfinity), kInfinity);
  EXPECT_EQ(elementary::expm1(5e-324), 5e-324);
  EXPECT_EQ(elementary::log(1), 0);
  EXPECT_EQ(elementary::log(0), -kInfinity);
  EXPECT_EQ(elementary::log(kInfinity), kInfinity);
  EXPECT_EQ(elementary::log1p(-1), -kInfinity);
  EXPECT_EQ(elementary::log1p(kInfinity), kInfinity);
  EXPECT_TRUE(std::signbit(elementary::log1p(-0.0)));
  EXPECT_EQ(elementary::log1p(-5e-324), -5e-324);
  EXPECT_EQ(elementary::erfc(0), 1);
  EXPECT_EQ(elementary::erfc(kInfinity), 0);
  EXPECT_EQ(elementary::erfc(-kInfinity), 2);
  EXPECT_EQ(elementary::pow(3, 0), 1);
  EXPECT_EQ(elementary::pow(1, 1e300), 1);
  EXPECT_EQ(elementary::pow(0, -2), kInfinity);
  EXPECT_EQ(elementary::pow(0, 2), 0);
  EXPECT_EQ(elementary::pow(2, 2000), kInfinity);
  EXPECT_EQ(elementary::pow(2, -2000), 0);
  EXPECT_EQ(elementary::pow(2, 1e300), kInfinity);
  EXPECT_EQ(elementary::pow(kInfinity, -1), 0);
  for (const double nan : {elementary::exp(kNaN), elementary::expm1(kNaN), elementary::log(kNaN), elementary::log(-1),
                           elementary::log1p(kNaN), elementary::log1p(-2), elementary::erfc(kNaN),
                           elementary::pow(-1, 2), elementary::pow(kNaN, 1)})
    EXPECT_TRUE(std::isnan(nan));
}

}  // namespace
}  // namespace carom::elementary_test
