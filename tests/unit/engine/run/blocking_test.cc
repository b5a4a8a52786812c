// SPDX-License-Identifier: BSD-3-Clause
#include "engine/run/blocking.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "engine/base/random.h"

namespace carom::blocking_test {
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

/// The error of a ratio of two columns is that of the jackknife over sixteen parts of two samples; the five samples
/// after these are left out. A mean has its plain standard error.
TEST(Blocking, FunctionsOfSumsHaveTheErrorOfTheJackknife) {
  constexpr std::size_t kParts = 16;
  RandomStream random(1, RandomPurpose::probe, 3);
  Blocking blocking(2);
  const auto ratio = [](std::span<const double> sums, double samples) { return sums[0] / (sums[1] + samples); };
  std::array<std::array<double, 2>, kParts> parts{};
  for (std::size_t i = 0; i < 2 * kParts + 5; ++i) {
    const std::array values = {3 + deviate(random), 7 + deviate(random)};
    blocking.add(values);
    EXPECT_EQ(std::isnan(blocking.error_of(ratio)), i + 1 < 8);
    if (i < 2 * kParts)
      for (const std::size_t k : {0, 1}) parts[i / 2][k] += values[k];
  }
  const auto jackknife = [&](auto&& function) {
    double sum = 0, squares = 0;
    for (std::size_t left_out = 0; left_out < kParts; ++left_out) {
      std::array<double, 2> sums{};
      for (std::size_t part = 0; part < kParts; ++part)
        for (const std::size_t k : {0, 1}) sums[k] += part == left_out ? 0 : parts[part][k];
      const double value = function(sums, 2.0 * (kParts - 1));
      sum += value;
      squares += value * value;
    }
    return std::sqrt((squares - sum * sum / kParts) * (kParts - 1) / kParts);
  };
  EXPECT_NEAR(blocking.error_of(ratio), jackknife(ratio), 1e-9);

  Blocking counted(1);
  for (int i = 0; i < 16; ++i) counted.add(std::array{1.0 * i});
  const auto mean = [](std::span<const double> sums, double samples) { return sums[0] / samples; };
  EXPECT_NEAR(counted.error_of(mean), std::sqrt(17.0 / 12), 1e-12);  // the variance of 0 … 15 is 16 · 17/12
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
}  // namespace carom::blocking_test
