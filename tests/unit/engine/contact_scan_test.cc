#include "engine/slabs/contact_scan.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/base/error.h"
#include "tests/support/experiments.h"

namespace carom {
namespace {

/// A scan of a system at rest in a slab of length 1 under the accelerations a.
struct Scene {
  Scene(std::vector<Vec<2>> x, std::vector<Vec<2>> v, std::vector<Vec<2>> acceleration, std::uint64_t max_events = 1000)
      : system(test::make_system<2>({20, 6}, Boundary::wall, x, v)),
        a(std::move(acceleration)),
        scan(*system, max_events) {
    scan.begin_slab(counters, &contacts, a, 1.0);
  }
  void resolve() {
    auto& p = system->particles;
    scan.resolve(0, p.x, p.v, [&](const Touch<2>& touch) { collide_elastically(touch, p); });
  }
  Touch<2> earliest(double rest) { return scan.earliest(system->particles.x, system->particles.v, a, rest); }

  std::unique_ptr<System<2>> system;
  std::vector<Vec<2>> a;
  Counters counters;
  std::vector<Contact<2>> contacts;
  ContactScan<2> scan;
};

TEST(ContactScan, FindsTheFirstContactOfPairsAndWalls) {
  Scene scene({{3, 3}, {6, 3}, {16, 3}}, {{1, 0}, {0, 0}, {0, -1}}, std::vector<Vec<2>>(3, Vec<2>::Zero()));
  scene.resolve();
  EXPECT_TRUE(scene.contacts.empty());
  auto touch = scene.earliest(10);
  EXPECT_TRUE(touch.pair());
  EXPECT_DOUBLE_EQ(touch.key.time, 2.0);
  scene.system->particles.v[2] = {0, -2};
  touch = scene.earliest(10);
  EXPECT_FALSE(touch.pair());
  EXPECT_EQ(touch.key.hi, 2u);  // the lower wall of axis 1
  EXPECT_DOUBLE_EQ(touch.key.time, 1.25);
  EXPECT_EQ(scene.earliest(1).key.time, kNever);
}

TEST(ContactScan, ResolvesABlowThroughAChainInKeyOrder) {
  Scene scene({{3, 3}, {4, 3}, {5, 3}}, {{1, 0}, {0, 0}, {0, 0}}, std::vector<Vec<2>>(3, Vec<2>::Zero()));
  scene.resolve();
  ASSERT_EQ(scene.contacts.size(), 2u);
  EXPECT_LT(scene.contacts[0].key, scene.contacts[1].key);
  EXPECT_EQ(scene.system->particles.v[2], Vec<2>(1, 0));
  EXPECT_EQ(scene.contacts[1].impulse, Vec<2>(-1, 0));  // given to the lower id
  EXPECT_EQ(scene.counters.sphere_sphere, 2u);
}

TEST(ContactScan, LeavesAPairThatAnEarlierImpulseHasParted) {
  // A light disc runs into two heavy ones at once; the first blow throws it back from both.
  const double angle = 25 * std::numbers::pi / 180;
  auto system = test::make_system<2>(
      {20, 6}, Boundary::wall,
      {{5, 3}, {5 + std::cos(angle), 3 + std::sin(angle)}, {5 + std::cos(angle), 3 - std::sin(angle)}},
      {{1, 0}, {0, 0}, {0, 0}}, {0.6, 0.4, 0.4}, {0.001, 1, 1});
  Counters counters;
  ContactScan<2> scan(*system, 100);
  scan.begin_slab(counters, nullptr, {}, 1.0);
  auto& p = system->particles;
  scan.resolve(0, p.x, p.v, [&](const Touch<2>& touch) { collide_elastically(touch, p); });
  EXPECT_EQ(counters.sphere_sphere, 1u);
  EXPECT_EQ(p.v[2], Vec<2>(0, 0));
}

TEST(ContactScan, HoldsAPressedChainAndLetsAPulledOneGo) {
  // Three discs in a row: the outer ones are drawn inwards, then outwards.
  Scene scene({{3, 3}, {4, 3}, {5, 3}}, std::vector<Vec<2>>(3, Vec<2>::Zero()), {{2, 0.5}, {0, 0}, {-1, 0}});
  scene.resolve();
  ASSERT_EQ(scene.scan.resting().size(), 2u);
  auto a = scene.a;
  scene.scan.hold(scene.system->particles.v, a, 1.0);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(a[i][0], 1.0 / 3, 1e-14);  // they move on together
  EXPECT_EQ(a[0][1], 0.5);
  EXPECT_EQ(scene.scan.earliest(scene.system->particles.x, scene.system->particles.v, a, 1.0).key.time, kNever);
  a = {{-2, 0}, {0, 0}, {1, 0}};
  scene.scan.hold(scene.system->particles.v, a, 1.0);
  EXPECT_EQ(a[0], Vec<2>(-2, 0));
  EXPECT_EQ(a[2], Vec<2>(1, 0));
}

TEST(ContactScan, HoldsADiscOnAWall) {
  Scene scene({{3, 0.5}}, {{1, 0}}, {{0.1, -2}});
  scene.resolve();
  auto a = scene.a;
  scene.scan.hold(scene.system->particles.v, a, 1.0);
  EXPECT_EQ(a[0], Vec<2>(0.1, 0));
}

TEST(ContactScan, LimitsTheEventsOfASlab) {
  Scene scene({{3, 3}, {4, 3}, {5, 3}, {6, 3}}, {{1, 0}, {0, 0}, {0, 0}, {-1, 0}},
              std::vector<Vec<2>>(4, Vec<2>::Zero()), 3);
  try {
    scene.resolve();
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("particles"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("max_events_per_step = 3"), std::string::npos);
  }
}

}  // namespace
}  // namespace carom
