// SPDX-License-Identifier: BSD-3-Clause
#include "engine/run/blocking.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "engine/base/random.h"

namespace carom {
namespace {

/// Of mean 0 and variance 1: the sum of three uniform deviates.
double deviate(RandomStream& random) { return 2 * (random.uniform() + random.uniform() + random.uniform() - 1.5); }

/// A series with mean 3, variance 1 and correlations φ^lag, of which the fraction (1 − φ)/(1 + φ) is independent.
class Series {
 public:
  Series(double phi, unsigned seed) : phi_(phi), random_(1, RandomPurpose::probe, seed), x_(deviate(random_)) {}
  double next() {
    x_ = phi_ * x_ + std::sqrt(1 - phi_ * phi_) * deviate(random_);
    return 3 + x_;
  }

 private:
  double phi_;
  RandomStream random_;
  double x_;
};

/// Over 400 series of at least 40 independent samples, χ² of the deviations divided by the errors is 0.95 to 1.35 a
/// series. (Student's t of the 8 to 63 blocks has a mean square of 1.03 to 1.4, and that of 400 series scatters by
/// 0.08.)
TEST(Blocking, MeansScatterAsTheErrorsPredict) {
  constexpr unsigned kSeries = 400;
  for (const auto& [phi, samples] : {std::pair{0.0, 40}, {0.0, 1000}, {0.5, 300}, {0.9, 3000}, {0.98, 8000}}) {
    double chi_square = 0, independent = 0, with_error = 0;
    for (unsigned seed = 0; seed < kSeries; ++seed) {
      Series series(phi, seed);
      Blocking blocking(1);
      for (int i = 0; i < samples; ++i) blocking.add(std::array{series.next()});
      const Estimate e = blocking.estimate(0);
      if (std::isnan(e.error)) continue;
      with_error += 1;
      chi_square += (e.mean - 3) * (e.mean - 3) / (e.error * e.error);
      independent += e.samples;
    }
    EXPECT_GT(with_error, 0.95 * kSeries) << phi;
    EXPECT_NEAR(chi_square / with_error, 1.15, 0.25) << phi;
    EXPECT_NEAR(independent / with_error / (samples * (1 - phi) / (1 + phi)), 1.15, 0.2) << phi;
  }
}

/// A series that is extended to the number of samples that it asks for gets an error, at the latest with 200
/// independent samples.
TEST(Blocking, WithoutAnErrorItSaysHowManySamplesMayGiveOne) {
  EXPECT_EQ(Blocking(1).estimate(0).needed, 8);
  constexpr double phi = 0.98;
  for (unsigned seed = 0; seed < 100; ++seed) {
    Series series(phi, seed);
    Blocking blocking(1);
    Estimate e = blocking.estimate(0);
    while (e.needed > 0) {
      while (static_cast<double>(blocking.samples()) < e.needed) blocking.add(std::array{series.next()});
      e = blocking.estimate(0);
      ASSERT_EQ(std::isnan(e.error), e.needed > static_cast<double>(blocking.samples())) << seed;
      ASSERT_LT(blocking.samples(), 200 * (1 + phi) / (1 - phi)) << seed;
    }
  }
}

TEST(Blocking, MostSeriesThatAreShorterThanTheirCorrelationsHaveNoError) {
  int with_error = 0;
  for (unsigned seed = 0; seed < 100; ++seed) {
    Series series(0.9999, seed);
    Blocking blocking(1);
    for (int i = 0; i < 1000; ++i) blocking.add(std::array{series.next()});
    with_error += std::isnan(blocking.estimate(0).error) ? 0 : 1;
  }
  EXPECT_LT(with_error, 30);
  Blocking few(1);
  EXPECT_TRUE(std::isnan(few.estimate(0).mean));
  for (int i = 0; i < 7; ++i) few.add(std::array{i % 3 * 1.0});
  EXPECT_DOUBLE_EQ(few.estimate(0).mean, 6.0 / 7);
  EXPECT_TRUE(std::isnan(few.estimate(0).error));
  few.add(std::array{1.0});
  EXPECT_GT(few.estimate(0).error, 0);
}

/// Ratios: weights that vary, and values that are proportional to them but for noise. The variance of Σv/Σw is that of
/// v − m w over (Σw)².
TEST(Blocking, WeighsSamples) {
  RandomStream random(1, RandomPurpose::probe, 7);
  Blocking both(2);
  Blocking scaled(1);
  double values = 0, weights = 0;
  for (int i = 0; i < 5000; ++i) {
    const double w = random.uniform(), v = 1e6 * w + deviate(random);
    both.add(std::array{v, w}, std::array{w, 1.0});
    scaled.add(std::array{2 * v}, std::array{2 * w});
    values += v;
    weights += w;
  }
  const Estimate e = both.estimate(0), of_weights = both.estimate(1);
  EXPECT_NEAR(e.mean, values / weights, 1e-8);
  EXPECT_NEAR(e.error, std::sqrt(5000) / weights, 0.25 * e.error);
  EXPECT_NEAR(e.samples, 5000, 2500);
  EXPECT_NEAR(of_weights.mean, 0.5, 5 * of_weights.error);
  EXPECT_NEAR(of_weights.error, std::sqrt(1.0 / 12 / 5000), 0.25 * of_weights.error);
  EXPECT_EQ(scaled.estimate(0).error, e.error);
  EXPECT_EQ(scaled.estimate(0).mean, e.mean);
}

TEST(Blocking, AConstantHasNoError) {
  Blocking series(1);
  for (int i = 0; i < 300; ++i) series.add(std::array{0.1});
  EXPECT_EQ(series.estimate(0).mean, 0.1);
  EXPECT_EQ(series.estimate(0).error, 0);
  EXPECT_TRUE(std::isnan(series.estimate(0).samples));
  series.add(std::array{std::nan("")});
  EXPECT_TRUE(std::isnan(series.estimate(0).mean));
  EXPECT_TRUE(std::isnan(series.estimate(0).error));
}

TEST(Blocking, ContinuesFromAnArchive) {
  Series series(0.7, 0);
  Blocking whole(3);
  for (int i = 0; i < 700; ++i) {
    const std::array values = {series.next(), series.next(), 1.0};
    whole.add(values);
    Archive out;
    whole.archive(out);
    Archive in(out.bytes());
    Blocking copy;
    copy.archive(in);
    in.finish();
    whole = copy;
    if (i == 555) whole = Blocking(copy);
  }
  Series again(0.7, 0);
  Blocking other(3);
  for (int i = 0; i < 700; ++i) other.add(std::array{again.next(), again.next(), 1.0});
  for (const std::size_t column : {0, 1, 2}) {
    EXPECT_EQ(whole.estimate(column).mean, other.estimate(column).mean);
    EXPECT_EQ(whole.estimate(column).error, other.estimate(column).error);
  }
}

}  // namespace
}  // namespace carom
