// SPDX-License-Identifier: BSD-3-Clause
// A halo is as wide as paths and collisions need, and a division ends before a particle exceeds its displacement.

#include "engine/ranks/halo_width.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace carom::halo_width_test {
namespace {

constexpr double kReach = 2.5, kPath = 0.01, kDiameter = 1;

HaloWidth fitted(bool cores) {
  HaloWidth width;
  width.start(cores);
  width.fit(kReach, kPath, kDiameter);
  return width;
}

TEST(HaloWidth, IsDeeperWhereParticlesCollide) {
  EXPECT_EQ(fitted(false).far(), fitted(false).near() + kReach - kDiameter);
  EXPECT_GE(fitted(true).far(), fitted(true).near() + 2 * kDiameter);
  EXPECT_EQ(fitted(true).near(), fitted(false).near());
}

TEST(HaloWidth, AllowsForPathsThatWereTooLongUntilThatIsLongAgo) {
  HaloWidth width = fitted(true);
  const double first = width.near();
  EXPECT_TRUE(width.allows(1.5 * kPath));
  EXPECT_FALSE(width.allows(5 * kPath));
  EXPECT_FALSE(width.take_request());
  width.ask_for_path(5 * kPath);
  EXPECT_TRUE(width.take_request());
  EXPECT_FALSE(width.take_request());
  width.fit(kReach, kPath, kDiameter);
  EXPECT_TRUE(width.allows(5 * kPath));
  EXPECT_GT(width.near(), first);
  for (int k = 0; k < 10; ++k) width.relax();
  width.fit(kReach, kPath, kDiameter);
  EXPECT_EQ(width.near(), first);
  width.ask_for_path(std::numeric_limits<double>::infinity());
  EXPECT_FALSE(width.take_request());  // no width is sufficient
}

TEST(HaloWidth, GrowsDeeperWhereCopiesWentWrong) {
  HaloWidth width = fitted(true);
  const double depth = width.far() - width.near();
  width.ask_for_depth();
  EXPECT_TRUE(width.take_request());
  width.fit(kReach, kPath, kDiameter);
  EXPECT_DOUBLE_EQ(width.far() - width.near(), 2 * depth);
  for (int k = 0; k < 10; ++k) width.relax();
  width.fit(kReach, kPath, kDiameter);
  EXPECT_DOUBLE_EQ(width.far() - width.near(), depth);
}

/// Two particles may each have moved this far and continue for one slab while they can touch or interact.
TEST(HaloWidth, IsOutdatedBeforeAParticleHasComeTooFar) {
  for (const double path : {0.001, 0.01, 0.1, 1.0}) {
    HaloWidth width = fitted(true);
    width.fit(kReach, path, kDiameter);
    double come = 0;
    int slabs = 0, looks = 0;
    while (!width.outdated([&] { return ++looks, come; })) {
      ASSERT_TRUE(width.allows(2 * path));
      come += 2 * path;
      EXPECT_LE(kDiameter + 2 * come, width.near()) << path;
      EXPECT_LE(kReach + 2 * come, width.far()) << path;
      ++slabs;
    }
    EXPECT_GE(slabs, 1) << path;
    EXPECT_LE(looks, 10) << path;
    width.fit(kReach, path, kDiameter);
    EXPECT_FALSE(width.outdated([] { return 0.0; }));
    // Even if it was slower before, it may have the largest allowed speed in the next slab.
    for (come = 0; width.fit(kReach, path, kDiameter), !width.outdated([&] { return come; }); come += 0.01)
      ASSERT_LE(kDiameter + 2 * (come + 2 * path), width.near()) << path;
  }
}

}  // namespace
}  // namespace carom::halo_width_test
