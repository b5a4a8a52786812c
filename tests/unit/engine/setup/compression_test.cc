// SPDX-License-Identifier: BSD-3-Clause
#include "engine/setup/compression.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/setup/placement.h"

namespace carom::compression_test {
namespace {

constexpr Boundary W = Boundary::wall, P = Boundary::periodic;

template <int D>
Box<D> box_for(const std::vector<double>& radius, double fraction, std::array<Boundary, D> boundary) {
  Box<D> box;
  box.edges = Vec<D>::Constant(std::pow(packing_fraction<D>(1, radius) / fraction, 1.0 / D));
  box.boundary = boundary;
  return box;
}

std::vector<double> two_sizes(std::size_t n, std::size_t large, double ratio) {
  std::vector<double> radius(n, 0.5);
  std::fill_n(radius.begin(), large, 0.5 * ratio);
  return radius;
}

/// Expects no overlap through any image, not even by rounding, and all spheres in the box and inside its walls.
template <int D>
void expect_sound(const Box<D>& box, const std::vector<double>& radius, const Compression<D>& done) {
  ASSERT_TRUE(done.reached()) << "factor " << done.factor << ", pressure " << done.reduced_pressure;
  ASSERT_EQ(done.x.size(), radius.size());
  EXPECT_GT(done.factor, 1);  // just enough that rounding makes no overlaps
  for (std::size_t i = 0; i < radius.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      Vec<D> d = done.x[i] - done.x[j];
      d += box.shift(box.nearest_image(d));
      ASSERT_GE(d.norm(), radius[i] + radius[j]) << i << " and " << j;
    }
    for (int k = 0; k < D; ++k) {
      const double margin = box.walled(k) ? radius[i] : 0;
      ASSERT_GE(done.x[i][k], margin) << i;
      ASSERT_LE(done.x[i][k], box.edges[k] - margin) << i;
    }
  }
}

template <int D>
void expect_reached(const std::vector<double>& radius, double fraction, std::array<Boundary, D> boundary,
                    const CompressionOptions& options = {}) {
  const auto box = box_for<D>(radius, fraction, boundary);
  expect_sound<D>(box, radius, compress<D>(box, radius, options));
}

/// The radii grow inside a cavity and outside a rod, where the distance at which a sphere touches shrinks and grows.
TEST(Compression, FillsACavityAroundARod) {
  Box<3> box{.edges = {8, 8, 8}, .boundary = {W, W, W}};
  box.add({.name = "cavity", .round = 4, .centre = {4, 4, 4}});
  box.add({.name = "rod", .round = 0.5, .inside = false, .centre = {4, 4, 4}, .direction = {0, 0, 1}});
  const std::vector<double> radius(220, 0.5);  // half of the cavity
  const Compression<3> done = compress<3>(box, radius, {.seed = 2});
  expect_sound<3>(box, radius, done);
  for (const Vec<3>& x : done.x) {
    EXPECT_GE(box.wall(6).gap(x, 0.5), 0);
    EXPECT_GE(box.wall(7).gap(x, 0.5), 0);
  }
}

TEST(Compression, ReachesRandomClosePackingOfEqualSpheres) {
  expect_reached<3>(std::vector<double>(100, 0.5), 0.64, {P, P, P}, {.seed = 3});
}

TEST(Compression, ReachesDenseDiscsOfTwoSizes) { expect_reached<2>(two_sizes(150, 75, 1.4), 0.84, {P, P}); }

TEST(Compression, ReachesDenseStatesBetweenWalls) {
  expect_reached<2>(two_sizes(100, 50, 1.4), 0.75, {W, W});
  expect_reached<2>(two_sizes(100, 50, 1.4), 0.78, {P, W});
  expect_reached<3>(std::vector<double>(120, 0.5), 0.50, {W, P, W});
}

TEST(Compression, ReachesDenseMixturesUpToTenToOne) {
  expect_reached<3>(two_sizes(200, 100, 1.4), 0.60, {P, P, P});
  expect_reached<3>(two_sizes(150, 6, 10), 0.45, {P, P, P}, {.growth_rate = 0.5});
  expect_reached<2>(two_sizes(120, 6, 10), 0.65, {P, W}, {.growth_rate = 0.5});
  std::vector<double> polydisperse;
  for (int i = 0; i < 200; ++i) polydisperse.push_back(0.3 + 0.005 * ((i * 37) % 100));
  expect_reached<3>(polydisperse, 0.58, {P, P, P});
}

TEST(Compression, SmallSystemsAndLowDensitiesComeOutToo) {
  expect_reached<2>({0.5}, 0.7, {P, P});
  expect_reached<3>({0.5}, 0.52, {W, W, W});
  expect_reached<3>({0.5, 0.3}, 0.3, {P, P, P});
  expect_reached<3>(std::vector<double>(50, 0.5), 0.01, {P, P, P});
}

TEST(Compression, DependsOnTheSeedAndOnNothingElse) {
  const auto radius = two_sizes(60, 30, 1.4);
  const auto box = box_for<3>(radius, 0.5, {P, P, P});
  const auto one = compress<3>(box, radius, {.seed = 1}), again = compress<3>(box, radius, {.seed = 1});
  const auto other = compress<3>(box, radius, {.seed = 2});
  EXPECT_EQ(one.x, again.x);
  EXPECT_EQ(one.reduced_pressure, again.reduced_pressure);
  EXPECT_NE(one.x, other.x);
}

TEST(Compression, SlowGrowthFollowsTheEquationOfState) {
  const std::vector<double> radius(400, 0.5);
  const double fraction = 0.40;
  const auto box = box_for<3>(radius, fraction, {P, P, P});
  const auto done = compress<3>(box, radius, {.growth_rate = 0.005});
  expect_sound<3>(box, radius, done);
  // Carnahan, Starling, J. Chem. Phys. 51 (1969) 635; the last slab ends at this fraction, and its average volume is 1
  // % larger.
  const double z = (1 + fraction + fraction * fraction - std::pow(fraction, 3)) / std::pow(1 - fraction, 3);
  EXPECT_NEAR(done.reduced_pressure, z, 0.08 * z);
}

TEST(Compression, TellsWhereTheSpheresJammed) {
  const std::vector<double> radius(40, 0.5);
  const auto box = box_for<3>(radius, 0.75, {P, P, P});
  const auto done = compress<3>(box, radius, {.growth_rate = 0.3});
  EXPECT_EQ(done.end, Compression<3>::End::jammed);
  const double reached = 0.75 * std::pow(done.factor, 3);
  EXPECT_GT(reached, 0.60);
  EXPECT_LT(reached, 0.74);
  auto smaller = radius;
  for (double& r : smaller) r *= done.factor;
  EXPECT_EQ(find_overlaps<3>(box, done.x, smaller).pairs, 0u);  // up to here it compressed without overlap
}

TEST(Compression, GrowthFasterThanTheSpheresEndsToo) {
  const std::vector<double> radius(60, 0.5);
  const auto box = box_for<3>(radius, 0.45, {P, P, P});
  expect_sound<3>(box, radius, compress<3>(box, radius, {.growth_rate = 10}));
  EXPECT_FALSE(compress<3>(box_for<3>(radius, 0.9, {P, W, P}), radius, {.growth_rate = 1e3}).reached());
}

TEST(Compression, GivesUpAfterTooManyCollisions) {
  const std::vector<double> radius(60, 0.5);
  const auto box = box_for<3>(radius, 0.6, {P, P, P});
  const auto done = compress<3>(box, radius, {.growth_rate = 1e-9, .max_collisions = 500});
  EXPECT_EQ(done.end, Compression<3>::End::too_many_collisions);
  EXPECT_GT(done.collisions, 500);
  EXPECT_LT(done.collisions, 502);
  EXPECT_LT(done.factor, 1);
}

TEST(Compression, ASphereThatNeverCollidesEndsToo) {
  const std::vector<double> radius{0.5};
  const auto box = box_for<2>(radius, 0.5, {P, P});
  EXPECT_EQ(compress<2>(box, radius, {.growth_rate = 1e-9, .max_collisions = 100}).end,
            Compression<2>::End::too_many_collisions);
}

TEST(Compression, ABoxThatIsTooNarrowHasNoRoom) {
  const std::vector<double> radius{0.5, 1.0};
  Box<2> box;
  box.edges = {10, 1.99};
  for (const Boundary boundary : {P, W}) {
    box.boundary = {P, boundary};
    EXPECT_EQ(compress<2>(box, radius, {}).end, Compression<2>::End::no_room);
  }
}

}  // namespace
}  // namespace carom::compression_test
