// SPDX-License-Identifier: BSD-3-Clause
#include "engine/base/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <boost/math/constants/constants.hpp>

#include "tests/unit/potentials/precise.h"

namespace carom::random_test {
namespace {

using Block = std::array<std::uint32_t, 4>;

// Known answers of philox4x32 with ten rounds, from kat_vectors of Random123 (Salmon et al.), version 1.09.
TEST(Philox, GivesThePublishedKnownAnswers) {
  EXPECT_EQ(philox4x32({0, 0, 0, 0}, {0, 0}), (Block{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
  constexpr std::uint32_t ones = 0xffffffff;
  EXPECT_EQ(philox4x32({ones, ones, ones, ones}, {ones, ones}),
            (Block{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
  EXPECT_EQ(philox4x32({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}),
            (Block{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

TEST(RandomStream, RepeatsItselfAndDependsOnEachPartOfItsKey) {
  const auto first = [](std::uint64_t seed, RandomPurpose purpose, std::uint32_t id) {
    return RandomStream(seed, purpose, id).bits();
  };
  const std::uint64_t reference = first(1, RandomPurpose::velocity, 2);
  EXPECT_EQ(first(1, RandomPurpose::velocity, 2), reference);
  EXPECT_NE(first(2, RandomPurpose::velocity, 2), reference);
  EXPECT_NE(first(1 + (std::uint64_t{1} << 32), RandomPurpose::velocity, 2), reference);
  EXPECT_NE(first(1, RandomPurpose::position, 2), reference);
  EXPECT_NE(first(1, RandomPurpose::velocity, 3), reference);
}

TEST(RandomStream, NumbersBelowAreUniform) {
  RandomStream random(7, RandomPurpose::species, 0);
  std::array<int, 6> seen{};
  constexpr int throws = 60000;
  for (int n = 0; n < throws; ++n) ++seen.at(random.below(6));
  for (const int count : seen) EXPECT_NEAR(count, throws / 6, 5 * std::sqrt(throws / 6.0));  // five standard deviations
}

TEST(RandomStream, NormalNumbersHaveTheMomentsOfANormalDistribution) {
  double sum = 0, squares = 0, fourth = 0, product = 0;
  constexpr int pairs = 100000;
  RandomStream random(7, RandomPurpose::velocity, 0);
  for (int n = 0; n < pairs; ++n) {
    const auto [x, y] = random.normal_pair();
    sum += x + y;
    squares += x * x + y * y;
    fourth += x * x * x * x + y * y * y * y;
    product += x * y;
  }
  constexpr double n = 2.0 * pairs;
  EXPECT_NEAR(sum / n, 0, 5 / std::sqrt(n));
  EXPECT_NEAR(squares / n, 1, 5 * std::sqrt(2 / n));
  EXPECT_NEAR(fourth / n, 3, 5 * std::sqrt(96 / n));
  EXPECT_NEAR(product / pairs, 0, 5 / std::sqrt(pairs));
}

TEST(RandomStream, NormalNumbersAreThoseOfBoxAndMuller) {
  using test::Precise;
  RandomStream random(11, RandomPurpose::probe, 0);
  const auto expect_pair = [](double u, double turn) {
    const auto computed = normal_deviates(u, turn);
    const Precise length = sqrt(-2 * log(Precise(u)));
    const Precise angle = 2 * boost::math::constants::pi<Precise>() * turn;
    const Precise exact[] = {length * cos(angle), length * sin(angle)};
    for (int k = 0; k < 2; ++k) {
      const double ulp = std::abs(std::nextafter(computed[k], 10 * computed[k]) - computed[k]);
      EXPECT_LE(abs(computed[k] - exact[k]), 0.502 * ulp + length * 0x1p-61) << u << ' ' << turn;
    }
  };
  for (int n = 0; n < 2000; ++n) {
    const double u = random.uniform(), turn = random.uniform();
    expect_pair(u, turn);
  }
  for (const double u : {0x1p-53, 0.5, std::sqrt(0.5), 1 - 0x1p-53})
    for (int eighth = 0; eighth <= 8; ++eighth)
      for (const double off : {-0x1p-52, 0.0, 0x1p-52})
        expect_pair(u, std::clamp(eighth / 8.0 + off, 0x1p-53, 1 - 0x1p-53));
}

TEST(RandomStream, UniformNumbersStayInsideTheOpenInterval) {
  RandomStream random(3, RandomPurpose::position, 1);
  for (int n = 0; n < 100000; ++n) {
    const double u = random.uniform();
    ASSERT_GT(u, 0);
    ASSERT_LT(u, 1);
  }
}

}  // namespace
}  // namespace carom::random_test
