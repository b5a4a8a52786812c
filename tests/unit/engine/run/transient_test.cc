// SPDX-License-Identifier: BSD-3-Clause
#include "engine/run/transient.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/base/random.h"

namespace carom::transient_test {
namespace {

double deviate(RandomStream& random) { return 2 * (random.uniform() + random.uniform() + random.uniform() - 1.5); }

/// White's rule as it is written down: of all d, the one with the smallest z.
std::size_t by_definition(const std::vector<double>& x) {
  std::size_t found = 0;
  double least = INFINITY;
  for (std::size_t d = 0; d + 5 <= x.size(); ++d) {
    const auto n = static_cast<double>(x.size() - d);
    double mean = 0, squares = 0;
    for (std::size_t i = d; i < x.size(); ++i) mean += x[i] / n;
    for (std::size_t i = d; i < x.size(); ++i) squares += (x[i] - mean) * (x[i] - mean);
    if (squares / (n * n) < least) least = squares / (n * n), found = d;
  }
  return found;
}

struct Found {
  double end = -1, now = -1;
};

/// Samples at times 1, 2, … until the transient has ended; compares with the definition whenever the rule was applied.
Found find(double decay, double height, unsigned seed, int samples) {
  RandomStream random(1, RandomPurpose::probe, seed);
  Transient transient;
  std::vector<double> batches;
  double sum = 0;
  for (int t = 1; t <= samples; ++t) {
    const double x = 7 + height * std::exp(-t / decay) + deviate(random);
    sum += x;
    if (t % 5 == 0) batches.push_back(std::exchange(sum, 0) / 5);
    if (const auto end = transient.add(t, {x, 0.0})) {
      const std::size_t dropped = by_definition(batches);
      EXPECT_LE(2 * dropped, batches.size());
      EXPECT_EQ(*end, dropped == 0 ? 1.0 : 5.0 * static_cast<double>(dropped));
      return {*end, static_cast<double>(t)};
    }
    EXPECT_LT(t, 5 * (static_cast<int>(batches.size()) + 1));
  }
  return {};
}

TEST(Transient, EndsWhereTheMarginalStandardErrorIsSmallest) {
  double ends = 0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    const Found none = find(1, 0, seed, 1000), some = find(60, 30, seed, 5000);
    EXPECT_GT(none.end, 0);
    EXPECT_LE(none.now, 500);
    // After 60 ln(30 √5) = 252 the decaying part is smaller than the noise of a batch.
    EXPECT_GT(some.end, 100);
    EXPECT_LT(some.end, 500);
    EXPECT_GE(some.now, 2 * some.end);
    ends += some.end / 20;
  }
  EXPECT_NEAR(ends, 220, 60);
}

TEST(Transient, DoesNotEndWhileTheSeriesDrifts) {
  for (unsigned seed = 0; seed < 20; ++seed) EXPECT_EQ(find(1e5, 1e6, seed, 2000).end, -1);
}

TEST(Transient, RoundingIsNoDrift) {
  Transient transient;
  std::optional<double> end;
  for (int t = 1; t <= 100; ++t) {
    EXPECT_FALSE(end);
    end = transient.add(t, {3 + 1e-15 * t, 0.0});
  }
  EXPECT_EQ(end, 1.0);
}

TEST(Transient, TheLongestCountsAndAnArchiveContinues) {
  for (const int slow : {0, 1}) {
    RandomStream random(1, RandomPurpose::probe, 3);
    Transient transient;
    std::optional<double> end;
    double now = 0;
    while (!end && now < 5000) {
      now += 1;
      std::array<double, 2> sample = {deviate(random), deviate(random)};
      sample[slow] += 20 * std::exp(-now / 100);
      end = transient.add(now, sample);
      Archive out;
      transient.archive(out);
      transient = {};
      Archive in(out.bytes());
      transient.archive(in);
      in.finish();
    }
    ASSERT_TRUE(end);
    EXPECT_GT(*end, 150);
  }
}

}  // namespace
}  // namespace carom::transient_test
