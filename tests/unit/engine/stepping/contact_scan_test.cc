// SPDX-License-Identifier: BSD-3-Clause
#include "engine/stepping/contact_scan.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <optional>

#include "engine/base/error.h"
#include "engine/events/meeting.h"
#include "tests/support/experiments.h"

namespace carom::contact_scan_test {
namespace {

/// Scans a system at rest in a slab of length 1 with the accelerations a.
struct Scene {
  Scene(std::vector<Vec<2>> x, std::vector<Vec<2>> v, std::vector<Vec<2>> acceleration, std::uint64_t max_events = 1000)
      : system(test::make_system<2>({20, 6}, Boundary::wall, x, v)),
        a(std::move(acceleration)),
        scan(*system, max_events, reactions) {
    scan.begin_step(counters, &contacts, &a, 1.0);
  }
  void resolve() {
    auto& p = system->particles;
    scan.resolve(0, p.x, p.v, [&](const Touch<2>& touch) {
      return resolve_contact<2>(touch.key, touch.normal, system->box, system->particles);
    });
  }
  Touch<2> earliest(double rest) { return scan.earliest(system->particles.x, system->particles.v, a, rest); }

  std::unique_ptr<System<2>> system;
  std::vector<Vec<2>> a;
  Counters counters;
  std::vector<Contact<2>> contacts;
  std::vector<Reaction<2>> reactions;
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
  EXPECT_EQ(scene.contacts[1].impulse, Vec<2>(-1, 0));  // on the lower id
  EXPECT_EQ(scene.counters.sphere_sphere, 2u);
}

TEST(ContactScan, LeavesAPairThatAnEarlierImpulseHasParted) {
  // A light disc hits two heavy ones at once; the first collision reverses it, away from both.
  const double angle = 25 * std::numbers::pi / 180;
  auto system = test::make_system<2>(
      {20, 6}, Boundary::wall,
      {{5, 3}, {5 + std::cos(angle), 3 + std::sin(angle)}, {5 + std::cos(angle), 3 - std::sin(angle)}},
      {{1, 0}, {0, 0}, {0, 0}}, {0.6, 0.4, 0.4}, {0.001, 1, 1});
  Counters counters;
  std::vector<Reaction<2>> reactions;
  ContactScan<2> scan(*system, 100, reactions);
  scan.begin_step(counters, nullptr, nullptr, 1.0);
  auto& p = system->particles;
  scan.resolve(0, p.x, p.v, [&](const Touch<2>& touch) {
    return resolve_contact<2>(touch.key, touch.normal, system->box, system->particles);
  });
  EXPECT_EQ(counters.sphere_sphere, 1u);
  EXPECT_EQ(p.v[2], Vec<2>(0, 0));
}

TEST(ContactScan, HoldsAPressedChainAndLetsAPulledOneGo) {
  // Three discs in a row: the outer ones are pulled inwards, then outwards.
  Scene scene({{3, 3}, {4, 3}, {5, 3}}, std::vector<Vec<2>>(3, Vec<2>::Zero()), {{2, 0.5}, {0, 0}, {-1, 0}});
  scene.resolve();
  ASSERT_EQ(scene.scan.resting().size(), 2u);
  auto a = scene.a;
  scene.scan.hold(scene.system->particles.v, a, 1.0);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(a[i][0], 1.0 / 3, 1e-14);  // they move together
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

/// The squared distance of a pair at time s, less that at contact.
double squared_gap(const Vec<2>& d, const Vec<2>& u, const Vec<2>& a, double s) {
  return (d + s * u + 0.5 * s * s * a).squaredNorm() - 1;
}

TEST(ContactScan, HoldsATurningPairThatIsBraked) {
  // The pair turns by u and is decelerated by u·a: held apart just enough that it does not overlap before the end.
  for (const double rest : {0.01, 0.1, 0.25}) {
    for (const double braking : {0.0, 1.0, -1.0}) {
      Scene scene({{3, 3}, {4, 3}}, {{0, 0.5}, {0, -0.5}}, {{2, -braking}, {-2, 0}});
      scene.resolve();
      ASSERT_EQ(scene.scan.resting().size(), 1u);
      auto a = scene.a;
      scene.scan.hold(scene.system->particles.v, a, rest);
      ASSERT_EQ(scene.scan.resting().size(), 1u);
      const Vec<2> d = {-1, 0}, u = {0, 1}, held = a[0] - a[1];
      EXPECT_NEAR(d.dot(held), -1 + std::max(0.0, braking) * rest, 1e-14);
      for (int k = 1; k <= 8; ++k) EXPECT_GE(squared_gap(d, u, held, 0.125 * k * rest), -1e-15) << rest << " " << k;
      EXPECT_EQ(held[1], -braking);
    }
  }
}

TEST(ContactScan, AContactThatWouldOpenByLessThanTheRestingGapRests) {
  // A force of 2 presses on the floor: at speed v the gap opens by v²/4. Then pairs, pressed by forces or known
  // reactions.
  const double of_wall = std::sqrt(2 * 2 * kRestingGap * 0.5), of_pair = std::sqrt(2 * 3 * kRestingGap);
  for (const double share : {0.99, -0.99, 1.01, -1.01}) {
    const bool rests = std::abs(share) < 1;
    SCOPED_TRACE(share);
    Scene floor({{3, 0.5}}, {{0.5, share * of_wall}}, {{0, -2}});
    Scene forces({{3, 3}, {4, 3}}, {{-share * of_pair, 0.5}, {0, 0.5}}, {{1, 0}, {-2, 0}});
    Scene known({{3, 3}, {4, 3}}, {{-share * of_pair, 0.5}, {0, 0.5}}, {{0, 0}, {0, 0}});
    known.reactions = {{{.lo = 0, .hi = 1}, 1.5}};
    for (Scene* scene : {&floor, &forces, &known}) {
      scene->resolve();
      EXPECT_EQ(scene->scan.resting().size(), rests ? 1u : 0u);
      EXPECT_EQ(scene->contacts.size(), share < -1 ? 1u : 0u);
    }
  }
}

TEST(ContactScan, WhatHasBeenStoppedMayRunIntoSomethingElse) {
  // 0 is pressed on 1 and stops at it; 2, on which no force acts, was slower to leave than 1 is then.
  Scene scene({{3, 3}, {4, 3}, {5, 3}}, {{1e-6, 0}, {0, 0}, {1e-9, 0}}, {{2, 0}, {0, 0}, {0, 0}});
  auto& p = scene.system->particles;
  const double lost = scene.scan.resolve(0, p.x, p.v, [&](const Touch<2>& touch) {
    return resolve_contact<2>(touch.key, touch.normal, scene.system->box, scene.system->particles);
  });
  ASSERT_EQ(scene.contacts.size(), 1u);
  EXPECT_EQ(scene.contacts[0].key.lo, 1u);
  EXPECT_EQ(scene.contacts[0].key.hi, 2u);
  EXPECT_TRUE(scene.scan.rests({.lo = 0, .hi = 1}));
  EXPECT_FALSE(scene.scan.rests({.lo = 1, .hi = 2}));
  EXPECT_GE(p.v[2][0], p.v[1][0]);
  EXPECT_NEAR(p.v[0][0] + p.v[1][0] + p.v[2][0], 1.001e-6, 1e-20);
  EXPECT_NEAR(0.5 * (p.v[0].squaredNorm() + p.v[1].squaredNorm() + p.v[2].squaredNorm()) + lost, 0.5 * (1e-12 + 1e-18),
              1e-26);
}

TEST(ContactScan, SlidingKeepsEnergyAndMomentumOfUnequalMasses) {
  for (const std::vector<double>& mass : {std::vector<double>{1, 5}, {5, 1}}) {
    auto system = test::make_system<2>({20, 6}, Boundary::open, {{3, 3}, {4, 3}}, {{0, 0.5}, {0, -0.1}}, {}, mass);
    Counters counters;
    std::vector<Reaction<2>> reactions;
    ContactScan<2> scan(*system, 100, reactions);
    const std::vector<Vec<2>> a = {{2, 0}, {-2, 0}};
    scan.begin_step(counters, nullptr, &a, 1.0);
    auto& p = system->particles;
    scan.resolve(0, p.x, p.v, [&](const Touch<2>& touch) {
      return resolve_contact<2>(touch.key, touch.normal, system->box, system->particles);
    });
    auto held = a;
    scan.hold(p.v, held, 0.1);
    ASSERT_EQ(scan.resting().size(), 1u);
    const Vec<2> normal = Vec<2>(-0.996, -0.0894).normalized();
    const std::vector<Vec<2>> turned = {{3, 3}, Vec<2>(3, 3) - normal};
    auto v = p.v;
    EXPECT_EQ(scan.slide(turned, v), 0);
    EXPECT_NEAR(normal.dot(v[0] - v[1]), 0, 1e-16);
    const auto energy = [&](const std::vector<Vec<2>>& of) {
      return 0.5 * (mass[0] * of[0].squaredNorm() + mass[1] * of[1].squaredNorm());
    };
    EXPECT_NEAR(energy(v), energy(p.v), 1e-16);
    EXPECT_LE((mass[0] * (v[0] - p.v[0]) + mass[1] * (v[1] - p.v[1])).norm(), 1e-15);
    EXPECT_GT((v[0] - p.v[0]).norm(), 1e-3);
  }
}

TEST(ContactScan, WhatNothingHasHeldDoesNotSlide) {
  Scene scene({{3, 3}, {4, 3}}, {{0, 0.5}, {0, -0.5}}, {{-2, 0}, {2, 0}});
  scene.resolve();
  ASSERT_EQ(scene.scan.resting().size(), 1u);
  std::vector<Vec<2>> v = {{-0.125, 0.5}, {0.125, -0.5}};
  const auto given = v;
  EXPECT_EQ(scene.scan.slide(scene.system->particles.x, v), 0);
  EXPECT_EQ(v, given);
}

TEST(ContactScan, RemembersTheReactionsOfContactsThatArePressed) {
  Scene scene({{3, 0.5}, {3, 1.5}, {5, 0.5}}, std::vector<Vec<2>>(3, Vec<2>::Zero()), {{0, -1}, {0, -1}, {0, 1}});
  scene.resolve();
  EXPECT_EQ(scene.scan.resting().size(), 3u);
  auto a = scene.a;
  scene.scan.hold(scene.system->particles.v, a, 1.0);
  scene.scan.remember(1);
  ASSERT_EQ(scene.reactions.size(), 2u);
  EXPECT_EQ(scene.reactions[0].key.hi, 1u);
  EXPECT_NEAR(scene.reactions[0].force, 1, 1e-14);
  EXPECT_EQ(scene.reactions[1].key.kind, EventKind::wall);
  EXPECT_NEAR(scene.reactions[1].force, 2, 1e-14);
  // Reactions count as forces in the rounding error: per mass, over all contacts of the particle.
  EXPECT_NEAR(scene.scan.rounding_speed(0, {0, 0}), kRounding * (1 + 1 + 2), 1e-26);
  EXPECT_NEAR(scene.scan.rounding_speed(1, {0, 3}), kRounding * (3 + 1 + 1), 1e-26);
  // The next piece starts from these reactions, and those that are no longer needed are removed.
  scene.resolve();
  EXPECT_EQ(scene.scan.resting()[0].force, scene.reactions[0].force);
  a.assign(3, {0, 1});
  a[1] = {0, 2};
  scene.scan.hold(scene.system->particles.v, a, 1.0);
  scene.scan.remember(1);
  EXPECT_TRUE(scene.reactions.empty());
}

/// A pair with this gap and a force of 2 on each disc; hold_means over `length` returns the mean velocities.
std::vector<Vec<2>> held_means(double gap, double length) {
  Scene scene({{3, 3}, {4 + gap, 3}}, {{0, 0}, {0, 0}}, {{2, 0}, {-2, 0}});
  scene.resolve();
  const auto& p = scene.system->particles;
  std::vector<Vec<2>> w = {0.5 * length * scene.a[0], 0.5 * length * scene.a[1]};
  EXPECT_TRUE(scene.scan.hold_means(p.x, p.v, w, length));
  EXPECT_EQ(scene.scan.resting().size(), 1u);
  for (const auto& contact : scene.scan.resting()) EXPECT_NEAR(contact.force, 2, 1e-9);
  return w;
}

TEST(ContactScan, HoldsMeansWithoutWork) {
  // Forces of 2 on unit masses are balanced by a reaction of 2, forwards and backwards in time.
  for (const double length : {0.1, -0.1})
    for (const auto& w : held_means(0, length)) EXPECT_LE(w.norm(), 1e-15) << length;
}

TEST(ContactScan, RoundingThatHasOpenedOrClosedAContactIsTakenBack) {
  // 0.7 tolerances of this box: more than half a tolerance.
  const double gap = 0.7 * Box<2>{{20, 6}, {Boundary::wall, Boundary::wall}}.gap_tolerance()(1.0);
  for (const double length : {0.1, -0.1}) {
    const auto opened = held_means(gap, length), closed = held_means(-gap, length);
    // The change of x_1 − x_0 in the piece.
    EXPECT_LT(length * (opened[1] - opened[0])[0], -1e-16) << length;
    EXPECT_GT(length * (closed[1] - closed[0])[0], 1e-16) << length;
    EXPECT_GE(length * (opened[1] - opened[0])[0], -1.01 * gap) << length;
    EXPECT_LE(length * (closed[1] - closed[0])[0], 1.01 * gap) << length;
  }
}

/// A column of discs of masses 2, 2, 4: the floor holds 0, which holds 1, and 2 comes down on 1 at the acceleration of
/// 1. The forces alone do not press 2 on 1; the reaction that holds 1 does.
struct Column {
  explicit Column(const Parameters& law, const std::vector<Vec<2>>& accelerations = {{0, -1}, {0, -3}, {0, -3}})
      : system(test::make_system<2>({20, 9}, Boundary::wall, {{3, 1}, {3, 3}, {3, 5}},
                                    std::vector<Vec<2>>(3, Vec<2>::Zero()), {1, 1, 1}, {2, 2, 4})),
        a(accelerations),
        reactions(
            {{{.kind = EventKind::pair, .lo = 0, .hi = 1}, 2}, {{.kind = EventKind::wall, .lo = 0, .hi = 2}, 6}}) {
    test::set_law(*system, law);
    criterion.emplace(system->box, system->particles, reactions);
  }
  double stopping(Id lo, Id hi, EventKind kind, double kick, double force = 0) {
    criterion->stop_within(kick);
    criterion->begin_step(&a, 0.1);
    const EventKey<2> key{.kind = kind, .lo = lo, .hi = hi};
    return criterion
        ->limits(key, contact_normal<2>(system->box, system->particles, key, system->particles.x), force, {0, 0},
                 {0, 0})
        .stopping;
  }
  double holding(double length) {
    criterion->begin_step(&a, length);
    return criterion->limits({.lo = 1, .hi = 2}, {0, -2}, 0, {0, 0}, {0, 0}).holding;
  }
  std::unique_ptr<System<2>> system;
  std::vector<Vec<2>> a;
  std::vector<Reaction<2>> reactions;
  std::optional<RestCriterion<2>> criterion;
};

TEST(RestCriterion, ReactionsPressWhatComesDownOnThoseTheyHold) {
  // With kicks in a time k an approach stops below 0.01 + k·pressing/(1 − e); pressing is an acceleration.
  Column column({{"restitution", 0.5}, {"rest_speed", 0.01}});
  const auto pressing = [&](Id lo, Id hi, EventKind kind, double force = 0) {
    return (column.stopping(lo, hi, kind, 0.1, force) - 0.01) / 0.2;
  };
  EXPECT_NEAR(pressing(1, 2, EventKind::pair), 1, 1e-14);       // 0 holds 1 with 2/2, and both fall at 3
  EXPECT_NEAR(pressing(1, 2, EventKind::pair, 6), 4.5, 1e-14);  // its own reaction: 6/2 + 6/4
  EXPECT_NEAR(pressing(0, 1, EventKind::pair), 3, 1e-14);       // 0 rises at 6/2 − 2/2 − 1, 1 at 2/2 − 3
  EXPECT_NEAR(pressing(0, 2, EventKind::wall), 1, 1e-14);       // by forces; reactions lift it
  column.reactions.clear();
  EXPECT_NEAR(pressing(1, 2, EventKind::pair), 0, 1e-14);
  EXPECT_NEAR(pressing(0, 2, EventKind::wall), 1, 1e-14);
}

TEST(RestCriterion, ApproachesStopThatKicksCannotSustain) {
  const auto stopping = [](double e, double kick) {
    return Column({{"restitution", e}, {"rest_speed", 0.01}}).stopping(1, 2, EventKind::pair, kick);
  };
  EXPECT_EQ(stopping(0.5, 0), 0.01);
  EXPECT_NEAR(stopping(0.5, 0.1), 0.01 + 0.1 / 0.5, 1e-15);
  EXPECT_NEAR(stopping(0.9, 0.1), 0.01 + 0.1 / 0.1, 1e-14);
  EXPECT_NEAR(stopping(0.999, 0.1), 0.01 + 0.1 * kMostBounces, 1e-14);
  EXPECT_NEAR(stopping(0.5, 0.001), 0.01 + 0.001, 1e-15);  // below the rest speed e is 0
  // Nothing presses 2 on 1 if it falls more slowly than 1 is held.
  Column leaving({{"restitution", 0.5}, {"rest_speed", 0.01}}, {{0, -1}, {0, -3}, {0, 0}});
  EXPECT_EQ(leaving.stopping(1, 2, EventKind::pair, 0.1), 0.01);
}

TEST(RestCriterion, SlowBouncesAreHeldWhereSomethingPresses) {
  Column column({{"restitution", 0.5}, {"rest_speed", 0.01}});
  EXPECT_NEAR(column.holding(0.1), 0.01, 1e-18);
  EXPECT_NEAR(column.holding(0.001), 0.0005, 1e-18);  // half of pressing · length
  EXPECT_NEAR(column.criterion->widest_gap(), 0.25 * kRestHeight * 2, 1e-18);
  column.criterion->stop_within(0.1);
  column.criterion->begin_step(&column.a, 0.2);
  EXPECT_NEAR(column.criterion->widest_gap(), 3 * 0.2 * 0.2 / 4, 1e-15);  // h²/8 of twice the largest acceleration
  column.reactions.clear();
  EXPECT_LT(column.holding(0.1), 1e-11);  // nothing presses
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
}  // namespace carom::contact_scan_test
