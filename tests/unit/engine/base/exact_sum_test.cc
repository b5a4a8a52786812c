// SPDX-License-Identifier: BSD-3-Clause
#include "engine/base/exact_sum.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace carom::exact_sum_test {
namespace {

using Wide = boost::multiprecision::number<boost::multiprecision::cpp_bin_float<2400>>;

std::vector<double> terms_of_all_sizes(std::size_t n, int exponents) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> mantissa(-1, 1);
  std::uniform_int_distribution<int> exponent(-exponents, exponents);
  std::vector<double> terms(n);
  for (auto& t : terms) t = std::ldexp(mantissa(random), exponent(random));
  return terms;
}

double sum_of(const std::vector<double>& terms) {
  ExactSum sum;
  for (double t : terms) sum.add(t);
  return sum.value();
}

TEST(ExactSum, IsTheCorrectlyRoundedSum) {
  for (int exponents : {0, 10, 60, 500}) {
    const auto terms = terms_of_all_sizes(2000, exponents);
    Wide exact = 0;
    for (double t : terms) exact += t;
    EXPECT_EQ(sum_of(terms), static_cast<double>(exact)) << "exponents up to " << exponents;
  }
}

TEST(ExactSeries, IsTheSameSum) {
  for (int exponents : {0, 4, 10, 30, 60, 500, 1000}) {
    std::vector<double> terms = terms_of_all_sizes(3000, exponents);
    if (exponents == 1000) terms.insert(terms.begin(), {0.0, -0x1p-1074, 0.0, 0x1p1023, -0x1p1023, 0x1p-900});
    ExactSeries series;
    for (double t : terms) series.add(t);
    EXPECT_EQ(series.sum().value(), sum_of(terms)) << "exponents up to " << exponents;
  }
}

TEST(ExactSeries, HasRoomForTheLargestTerms) {  // each term has all bits that the first digit of both sums holds
  const double largest = 0x1.ffffffffffep12;
  ExactSeries series;
  std::vector<double> terms(2000, largest);
  terms[0] = 1;
  for (double t : terms) series.add(t);
  EXPECT_EQ(series.sum().value(), sum_of(terms));
  series.add(std::numeric_limits<double>::infinity());
  EXPECT_TRUE(std::isnan(series.sum().value()));
}

TEST(ExactSum, DoesNotDependOnTheOrder) {
  auto terms = terms_of_all_sizes(1000, 300);
  const double sum = sum_of(terms);
  std::mt19937 random(3);
  for (int trial = 0; trial < 5; ++trial) {
    std::shuffle(terms.begin(), terms.end(), random);
    EXPECT_EQ(sum_of(terms), sum);
  }
}

TEST(ExactSum, JoinsPartsExactly) {
  const auto terms = terms_of_all_sizes(999, 200);
  ExactSum parts[3], all;
  for (std::size_t k = 0; k < terms.size(); ++k) parts[k % 3].add(terms[k]);
  for (const auto& part : parts) all.add(part);
  EXPECT_EQ(all.value(), sum_of(terms));
}

TEST(ExactSum, CancelsCompletely) {
  EXPECT_EQ(sum_of({1e300, 1.0, -1e300, 1e-300, -1.0}), 1e-300);
  EXPECT_EQ(sum_of({0.1, -0.1}), 0.0);
  EXPECT_EQ(sum_of({}), 0.0);
}

TEST(ExactSum, TakesIntegersOf128Bits) {
  __extension__ using Whole = __int128;
  const Whole large = (Whole{0x0123456789abcdef} << 64) + 0x7edcba9876543211;
  for (const Whole whole : {large, -large, Whole{1}, Whole{-1}, (Whole{1} << 52) + 1, -(Whole{1} << 96)}) {
    ExactSum sum;
    sum.add(whole, 0x1p-60);
    // In parts of 32 bits, from above.
    for (int k = 3; k >= 0; --k) {
      const auto part = static_cast<double>(static_cast<std::int64_t>(whole >> 32 * k) &
                                            (k == 3 ? ~std::int64_t{0} : std::int64_t{0xffffffff}));
      sum.add(-std::ldexp(part, 32 * k - 60));
    }
    EXPECT_EQ(sum.value(), 0);
  }
}

TEST(ExactSum, HoldsTheExtremes) {
  const double tiny = std::numeric_limits<double>::denorm_min(), huge = std::numeric_limits<double>::max();
  EXPECT_EQ(sum_of({tiny, tiny}), 2 * tiny);
  EXPECT_EQ(sum_of({huge, huge, -huge}), huge);
  EXPECT_EQ(sum_of({-huge}), -huge);
}

TEST(ExactSum, RoundsHalfwayCasesToEven) {
  const double ulp = std::numeric_limits<double>::epsilon();
  EXPECT_EQ(sum_of({1.0, ulp / 2}), 1.0);
  EXPECT_EQ(sum_of({1.0 + ulp, ulp / 2}), 1.0 + 2 * ulp);
  EXPECT_EQ(sum_of({1.0, ulp / 2, 1e-300}), 1.0 + ulp);
}

TEST(ExactSum, IsNotANumberWhenATermIsNot) {
  EXPECT_TRUE(std::isnan(sum_of({1.0, std::numeric_limits<double>::infinity()})));
  EXPECT_TRUE(std::isnan(sum_of({std::nan(""), 1.0})));
  ExactSum part, all;
  part.add(std::nan(""));
  all.add(1.0);
  all.add(part);
  EXPECT_TRUE(std::isnan(all.value()));
}

}  // namespace
}  // namespace carom::exact_sum_test
