// SPDX-License-Identifier: BSD-3-Clause
#include "engine/run/radial_distribution.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/base/error.h"
#include "engine/base/random.h"
#include "tests/support/experiments.h"

namespace carom::radial_distribution_test {
namespace {

/// Points at random positions; two species with 2/3 and 1/3 of them.
template <int D>
std::unique_ptr<System<D>> random_points(std::size_t n, const Vec<D>& edges, std::array<Boundary, D> boundary,
                                         double radius, unsigned seed) {
  std::vector<Vec<D>> x(n);
  for (std::size_t i = 0; i < n; ++i) {
    RandomStream random(seed, RandomPurpose::probe, static_cast<std::uint32_t>(i));
    for (int k = 0; k < D; ++k) {
      const double margin = boundary[k] == Boundary::wall ? radius : 0;
      x[i][k] = margin + (edges[k] - 2 * margin) * random.uniform();
    }
  }
  auto system = test::make_system<D>(edges, Boundary::periodic, x, std::vector<Vec<D>>(n, Vec<D>::Zero()),
                                     std::vector<double>(n, radius));
  system->box.boundary = boundary;
  system->species = {"a", "b"};
  for (std::size_t i = 0; i < n; ++i) system->particles.species[i] = i % 3 == 0;
  return system;
}

/// Pairs in each shell, from every image of every pair.
template <int D>
std::vector<double> counted_pairs(const System<D>& system, double range, int bins, int a, int b) {
  std::vector<double> counts(static_cast<std::size_t>(bins));
  const auto& p = system.particles;
  for (std::size_t i = 0; i < p.size(); ++i)
    for (std::size_t j = 0; j < p.size(); ++j) {
      if (i == j || p.species[i] != a || p.species[j] != b) continue;
      const Vec<D> d = p.x[i] - p.x[j];
      const double r = (d + system.box.shift(system.box.nearest_image(d))).norm();
      if (r < range) counts[static_cast<std::size_t>(r / range * bins)] += a == b ? 0.5 : 1;
    }
  return counts;
}

template <int D>
void expect_brute_force(const Vec<D>& edges, std::array<Boundary, D> boundary, double range) {
  for (const std::size_t n : {2u, 30u, 400u}) {
    const auto system = random_points<D>(n, edges, boundary, 0.05, 3);
    const int bins = 23;
    RadialDistribution<D> rdf(*system, {.sampling = {.interval = 1}, .range = range, .bins = bins});
    rdf.sample(0, system->particles);
    const double width = range / bins, ball = D == 2 ? std::numbers::pi : 4 * std::numbers::pi / 3;
    const double ones = std::ceil(static_cast<double>(n) / 3), others = static_cast<double>(n) - ones;
    bool periodic = true;
    for (int k = 0; k < D; ++k) periodic = periodic && system->box.periodic(k);
    for (int a = 0; a < 2; ++a)
      for (int b = 0; b < 2; ++b) {
        const auto counts = counted_pairs(*system, range, bins, a, b);
        const auto g = rdf.g(static_cast<std::size_t>(a), static_cast<std::size_t>(b));
        const double pairs = a != b ? ones * others : a == 1 ? ones * (ones - 1) / 2 : others * (others - 1) / 2;
        for (int k = 0; k < bins; ++k) {
          const double shell = ball * (std::pow((k + 1) * width, D) - std::pow(k * width, D));
          if (pairs == 0)
            EXPECT_TRUE(std::isnan(g[k]));
          else if (periodic)
            EXPECT_NEAR(g[k], counts[k] * edges.prod() / (pairs * shell), 1e-9 * (1 + g[k])) << n << ' ' << k;
          else  // the counts, without the normalisation
            EXPECT_EQ(g[k] > 0, counts[k] > 0) << n << ' ' << k;
        }
      }
  }
}

constexpr Boundary kPeriodic = Boundary::periodic, kWall = Boundary::wall;

TEST(RadialDistribution, CountsWhatBruteForceCounts) {
  expect_brute_force<2>({3.0, 4.0}, {kPeriodic, kPeriodic}, 1.5);
  expect_brute_force<2>({3.0, 40.0}, {kPeriodic, kPeriodic}, 0.4);
  expect_brute_force<3>({3.0, 4.0, 5.0}, {kPeriodic, kPeriodic, kPeriodic}, 1.5);
  expect_brute_force<3>({3.0, 4.0, 9.0}, {kPeriodic, kPeriodic, kPeriodic}, 0.31);
  expect_brute_force<3>({3.0, 4.0, 5.0}, {kPeriodic, kWall, kWall}, 1.5);
  expect_brute_force<2>({3.0, 4.0}, {kWall, kPeriodic}, 1.9);
}

TEST(RadialDistribution, HasAContactValueWhereAllRadiiAreOne) {
  for (const double other : {0.5, 0.45}) {
    auto run = test::make_run<3>(test::hard_spheres<3>(4, 0.3), "free-flight", {.step = 1, .end_time = 3});
    run->run();
    Particles<3>& p = run->system().particles;
    p.radius[7] = other;
    RadialDistribution<3> rdf(run->system(), {.sampling = {}, .range = 2, .bins = 40});
    rdf.sample(0, p);
    EXPECT_EQ(rdf.contact_value(0, 0).has_value(), other == 0.5);
  }
}

/// Spheres of radius 0.25 in shells around one of radius 0.5, from contact on, with g ∝ e^(−2(r − 0.75)). There is no
/// contact value if one sphere has another radius.
TEST(RadialDistribution, TheContactValueIsThatAtTheContactDistanceOfTwoSpecies) {
  constexpr double kWidth = 0.025, kEdge = 6, kDensity = 300;
  std::vector<Vec<3>> x = {Vec<3>::Constant(3)};
  for (int shell = 30; shell < 50; ++shell) {
    const double r = (shell + 0.5) * kWidth;
    const double volume = 4 * std::numbers::pi / 3 * (std::pow((shell + 1) * kWidth, 3) - std::pow(shell * kWidth, 3));
    const double expected = kDensity * volume * std::exp(-2 * (r - 0.75));
    const int spheres = static_cast<int>(std::round(expected));
    for (int k = 0; k < spheres; ++k) {
      const double angle = 2.4 * k, z = 1 - (2 * k + 1.0) / spheres, rho = std::sqrt(1 - z * z);
      x.push_back(x[0] + r * Vec<3>(rho * std::cos(angle), rho * std::sin(angle), z));
    }
  }
  const std::size_t n = x.size();
  std::vector<double> radius(n, 0.25);
  radius[0] = 0.5;
  auto system = test::make_system<3>(Vec<3>::Constant(kEdge), Boundary::periodic, x,
                                     std::vector<Vec<3>>(n, Vec<3>::Zero()), radius);
  system->species = {"a", "b"};
  for (std::size_t i = 1; i < n; ++i) system->particles.species[i] = 1;
  const double g = kDensity * std::pow(kEdge, 3) / static_cast<double>(n - 1);
  for (const bool swapped : {false, true}) {
    if (swapped)
      for (auto& species : system->particles.species) species = 1 - species;
    RadialDistribution<3> rdf(*system, {.sampling = {}, .range = 1.5, .bins = 60});
    rdf.sample(0, system->particles);
    EXPECT_NEAR(rdf.contact_value(0, 1).value(), g, 0.02 * g);
    EXPECT_EQ(rdf.contact_value(1, 0), rdf.contact_value(0, 1));
    system->particles.radius[n - 1] = 0.2;
    RadialDistribution<3> mixed(*system, {.sampling = {}, .range = 1.5, .bins = 60});
    mixed.sample(0, system->particles);
    EXPECT_FALSE(mixed.contact_value(0, 1));
    EXPECT_FALSE(mixed.contact_value(1, 0));
    system->particles.radius[n - 1] = 0.25;
  }
}

/// A parabola needs a fourth shell with pairs among the first six.
TEST(RadialDistribution, HasAContactValueFromFourShellsOn) {
  for (const int shells : {3, 4}) {
    std::vector<Vec<3>> x;
    for (int k = 0; k < shells; ++k) {
      const double y = 3 * k + 2.0;
      x.push_back({2, y, 2});
      x.push_back({3.025 + 0.05 * k, y, 2});
    }
    const auto system = test::make_system<3>(Vec<3>::Constant(15), Boundary::periodic, x,
                                             std::vector<Vec<3>>(x.size(), Vec<3>::Zero()));
    RadialDistribution<3> rdf(*system, {.sampling = {}, .range = 2, .bins = 40});
    rdf.sample(0, system->particles);
    EXPECT_EQ(rdf.contact_value(0, 0).has_value(), shells == 4);
  }
}

/// g averaged over many samples of an ideal gas: 1 at every r, also along walls.
template <int D>
void expect_ideal_gas(const Vec<D>& edges, std::array<Boundary, D> boundary, double range) {
  const std::size_t n = 100;
  const int samples = 3600, bins = 8;
  auto system = random_points<D>(n, edges, boundary, 0.1, 1);
  RadialDistribution<D> rdf(*system, {.sampling = {.interval = 1}, .range = range, .bins = bins});
  for (unsigned s = 0; s < samples; ++s) rdf.sample(s, random_points<D>(n, edges, boundary, 0.1, 100 + s)->particles);
  EXPECT_EQ(rdf.samples(), samples);
  const double width = range / bins, ball = D == 2 ? std::numbers::pi : 4 * std::numbers::pi / 3;
  for (int k = 0; k < bins; ++k) {
    // Counts have Poisson's scatter; walls make the density of partners depend on position, which adds about
    // 1/√(samples n).
    const double shell = ball * (std::pow((k + 1) * width, D) - std::pow(k * width, D));
    const double counts = samples * (n * n / 2.0) * shell / edges.prod();
    EXPECT_NEAR(rdf.g()[k], 1.0, 5 / std::sqrt(counts) + 0.005) << k;
    EXPECT_NEAR(rdf.g(0, 1)[k], 1.0, 10 / std::sqrt(counts) + 0.005) << k;
  }
}

TEST(RadialDistribution, OfAnIdealGasIsOne) {
  expect_ideal_gas<2>({6, 8}, {kPeriodic, kPeriodic}, 3);
  expect_ideal_gas<3>({6, 8, 7}, {kPeriodic, kPeriodic, kPeriodic}, 3);
  expect_ideal_gas<2>({6, 8}, {kWall, kWall}, 5);
  expect_ideal_gas<3>({6, 8, 7}, {kWall, kWall, kWall}, 5);
  expect_ideal_gas<3>({6, 8, 7}, {kPeriodic, kWall, kPeriodic}, 3);
}

TEST(RadialDistribution, DoesNotDependOnTheOrderOfParticles) {
  auto system = random_points<3>(500, {3, 4, 5}, {kPeriodic, kPeriodic, kPeriodic}, 0.05, 5);
  RadialDistribution<3> one(*system, {.sampling = {.interval = 1}, .range = 1.5, .bins = 1000});
  one.sample(0, system->particles);
  auto& p = system->particles;
  std::ranges::reverse(p.x);
  std::ranges::reverse(p.species);
  RadialDistribution<3> other(*system, {.sampling = {.interval = 1}, .range = 1.5, .bins = 1000});
  other.sample(0, p);
  EXPECT_EQ(one.g(), other.g());
  EXPECT_EQ(one.g(0, 1), other.g(1, 0));
}

TEST(RadialDistribution, RefusesWhatHasNoMeaning) {
  auto system = random_points<2>(10, {3, 4}, {kPeriodic, kPeriodic}, 0.05, 5);
  EXPECT_DOUBLE_EQ(RadialDistribution<2>::longest_range(*system), 1.5);
  EXPECT_DOUBLE_EQ(RadialDistribution<2>::usual_range(*system), 0.3);
  EXPECT_THROW(RadialDistribution<2>(*system, {.sampling = {}, .range = 1.6}), Error);
  EXPECT_THROW(RadialDistribution<2>(*system, {.sampling = {}, .range = 0}), Error);
  EXPECT_NO_THROW(RadialDistribution<2>(*system, {.sampling = {}, .range = 1.5}));
  system->box.boundary[1] = Boundary::open;
  EXPECT_THROW(RadialDistribution<2>(*system, {.sampling = {}, .range = 1}), Error);
  system->box.boundary = {kWall, kWall};
  EXPECT_DOUBLE_EQ(RadialDistribution<2>::longest_range(*system), 2.9);
}

}  // namespace
}  // namespace carom::radial_distribution_test
