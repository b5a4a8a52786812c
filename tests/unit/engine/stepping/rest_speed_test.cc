// SPDX-License-Identifier: BSD-3-Clause
// The default rest speed, and each term that decides which contacts come to rest.

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "engine/stepping/rest_criterion.h"
#include "tests/support/experiments.h"

namespace carom::rest_speed_test {
namespace {

/// Discs of masses 1 and 3 that touch, and 1 touches the floor; the accelerations that forces cause are given.
struct Two {
  Two(const Parameters& law, std::vector<Vec<2>> accelerations, std::vector<Reaction<2>> known = {}, double step = 0.1)
      : system(test::make_system<2>({20, 9}, Boundary::wall, {{3, 0.4}, {3, 1.4}},
                                    std::vector<Vec<2>>(2, Vec<2>::Zero()), {0.4, 0.6}, {1, 3})),
        a(std::move(accelerations)),
        reactions(std::move(known)) {
    test::set_law(*system, law);
    system->box.contacts.thermal_speed = 1e5;  // its rest speed, 1e-3, is less than those of the forces below
    criterion.emplace(system->box, system->particles, reactions);
    criterion->begin_step(&a, step);
  }
  double rest_speed(const EventKey<2>& key) const { return criterion->rest_speed(key, normal(key)); }
  RestLimits limits(const EventKey<2>& key, double force = 0, Vec<2> v = Vec<2>::Zero()) const {
    return criterion->limits(key, normal(key), force, v, v);
  }
  double resting(const EventKey<2>& key, double force = 0, Vec<2> v = Vec<2>::Zero()) const {
    return limits(key, force, v).resting;
  }
  Vec<2> normal(const EventKey<2>& key) const {
    return contact_normal<2>(system->box, system->particles, key, system->particles.x);
  }

  std::unique_ptr<System<2>> system;
  std::vector<Vec<2>> a;
  std::vector<Reaction<2>> reactions;
  std::optional<RestCriterion<2>> criterion;
};

const EventKey<2> kPair{.lo = 0, .hi = 1}, kFloor{.kind = EventKind::wall, .lo = 0, .hi = 2};
const Parameters kLaw{{"restitution", 0.5}};

TEST(RestSpeed, IsThatOfAFallFromHalfATenThousandthOfTheContactDistance) {
  const Two falls(kLaw, {{0, -1}, {0, -1}});
  EXPECT_DOUBLE_EQ(falls.rest_speed(kPair), std::sqrt(1e-4 * 1 * 1.0));
  EXPECT_DOUBLE_EQ(falls.rest_speed(kFloor), std::sqrt(1e-4 * 1 * 0.4));
}

TEST(RestSpeed, TakesTheStrongerAccelerationLessThatWhichPartsTheSpheres) {
  // 0 is below 1: it opens the pair where it falls faster.
  EXPECT_DOUBLE_EQ(Two(kLaw, {{0, -1}, {0, -4}}).rest_speed(kPair), std::sqrt(1e-4 * 4));
  EXPECT_DOUBLE_EQ(Two(kLaw, {{0, -4}, {0, -1}}).rest_speed(kPair), std::sqrt(1e-4 * (4 - 3)));
  EXPECT_DOUBLE_EQ(Two(kLaw, {{2, 0}, {2, 0}}).rest_speed(kPair), std::sqrt(1e-4 * 2));
  // Spheres that repel each other, and one that a force lifts off the floor.
  EXPECT_DOUBLE_EQ(Two(kLaw, {{0, -3}, {0, 1}}).rest_speed(kPair), 1e-3);
  EXPECT_DOUBLE_EQ(Two(kLaw, {{0, 1}, {0, 0}}).rest_speed(kFloor), 1e-3);
}

TEST(RestSpeed, WithoutForcesIsAFractionOfTheThermalSpeed) {
  EXPECT_DOUBLE_EQ(Two(kLaw, {{0, 0}, {0, 0}}).rest_speed(kPair), 1e-8 * 1e5);
  EXPECT_DOUBLE_EQ(Two(kLaw, {}).rest_speed(kPair), 1e-8 * 1e5);
  EXPECT_DOUBLE_EQ(Two(kLaw, {{0, -1e-4}, {0, -1e-4}}).rest_speed(kPair), 1e-8 * 1e5);
}

TEST(RestSpeed, OfALawThatNamesItIsThatOne) {
  EXPECT_EQ(Two({{"restitution", 0.5}, {"rest_speed", 1e-7}}, {{0, -1}, {0, -1}}).rest_speed(kPair), 1e-7);
  EXPECT_EQ(Two({{"restitution", 1.0}}, {{0, -1}, {0, -1}}).rest_speed(kPair), 0);
}

TEST(RestSpeed, OfAPowerLawStopsWhatTheLawWouldReturn) {
  // Below v0 the law is elastic; what presses stops these approaches, too.
  auto power = test::make_system<2>({20, 9}, Boundary::wall, {{3, 0.5}}, {{0, 0}});
  power->box.contacts.resize(1, 4);
  power->box.contacts.set_wall(0, 2, power->box.contacts.add({.v0 = 0.1, .exponent = 0.25}));
  const std::vector<Reaction<2>> none;
  const std::vector<Vec<2>> a = {{0, -1}};
  RestCriterion<2> criterion(power->box, power->particles, none);
  criterion.begin_step(&a, 0.1);
  EXPECT_DOUBLE_EQ(criterion.limits(kFloor, {0, 1}, 0, {0, 0}, {0, 0}).stopping, std::sqrt(1e-4 * 0.5));
}

TEST(RestSpeed, BoundsTheGapsFromWhichApproachesStop) {
  Two falls(kLaw, {{0, -1}, {0, -2}});
  // A quarter of the height from which a fall at 2 gives the rest speed, or the way at that speed in a 64th of the
  // step.
  const double speed = falls.rest_speed(kPair);
  for (const double step : {1e-2, 1e-6}) {
    falls.criterion->begin_step(&falls.a, step);
    EXPECT_DOUBLE_EQ(falls.criterion->widest_gap(kPair, falls.normal(kPair)), 0.25 * speed * speed / (2 * 2));
  }
  const Two fast({{"restitution", 0.5}, {"rest_speed", 0.3}}, {{0, -1}, {0, -2}}, {}, 1e-4);
  EXPECT_DOUBLE_EQ(fast.criterion->widest_gap(kPair, fast.normal(kPair)), 0.25 * kRestHeight * 1.0);
  const Two free({{"restitution", 0.5}, {"rest_speed", 0.3}}, {{0, 0}, {0, 0}}, {}, 1e-4);
  EXPECT_DOUBLE_EQ(free.criterion->widest_gap(kPair, free.normal(kPair)), 0.3 * 1e-4);
  EXPECT_GE(free.criterion->widest_gap(), 0.3 * 1e-4);
  falls.criterion->begin_step(&falls.a, 10);
  EXPECT_DOUBLE_EQ(falls.criterion->widest_gap(kPair, falls.normal(kPair)), speed * 10 / kMostBounces);
  EXPECT_GE(falls.criterion->widest_gap(), falls.criterion->widest_gap(kPair, falls.normal(kPair)));
  falls.criterion->begin_step(&falls.a, 0.1);
  EXPECT_GE(falls.criterion->widest_gap(), falls.criterion->widest_gap(kPair, falls.normal(kPair)));
  falls.criterion->stop_within(0.1);  // with kicks: h²/8 of the accelerations of the partners
  EXPECT_DOUBLE_EQ(falls.criterion->widest_gap(kPair, falls.normal(kPair)), 0.125 * 0.01 * 3);
  EXPECT_DOUBLE_EQ(falls.criterion->widest_gap(kFloor, falls.normal(kFloor)), 0.125 * 0.01 * 1);
  EXPECT_GE(falls.criterion->widest_gap(), falls.criterion->widest_gap(kPair, falls.normal(kPair)));
  const Two elastic({{"restitution", 1.0}}, {{0, -1}, {0, -2}});
  EXPECT_EQ(elastic.criterion->widest_gap(kPair, elastic.normal(kPair)), 0);
}

// The speeds at which contacts without a law rest: each term is the largest in one of the cases.
TEST(RestingSpeed, IsTheRoundingOfVelocitiesForcesAndReactions) {
  const Parameters elastic{{"restitution", 1.0}};
  const Vec<2> v(0, 3);
  EXPECT_DOUBLE_EQ(Two(elastic, {}).resting(kPair, 0, v), kRounding * 6);
  EXPECT_DOUBLE_EQ(Two(elastic, {}).resting(kFloor, 0, v), kRounding * 3);
  EXPECT_DOUBLE_EQ(Two(elastic, {{5, 0}, {7, 0}}).resting(kPair), kRounding * 0.1 * (5 + 7));
  // A reaction of 6 at the floor presses 0 alone, one of 6 between both presses each.
  EXPECT_DOUBLE_EQ(Two(elastic, {}, {{kFloor, 6}}).criterion->rounding_speed(0, Vec<2>::Zero()), kRounding * 0.1 * 6);
  const Two pressed(elastic, {}, {{kPair, 6}});
  EXPECT_DOUBLE_EQ(pressed.criterion->rounding_speed(0, Vec<2>::Zero()), kRounding * 0.1 * 6);
  EXPECT_DOUBLE_EQ(pressed.criterion->rounding_speed(1, Vec<2>::Zero()), kRounding * 0.1 * 2);
}

TEST(RestingSpeed, IsThatOfABounceThatOpensNoGapOrIsTooShort) {
  const Parameters elastic{{"restitution", 1.0}};
  const std::vector<Vec<2>> pressing = {{0, 0}, {0, -2}};
  EXPECT_DOUBLE_EQ(Two(elastic, pressing).resting(kPair), std::sqrt(2 * 2 * kRestingGap * 1.0));
  EXPECT_DOUBLE_EQ(Two(elastic, pressing, {}, 1e-6).resting(kPair), 0.5 * 2 * 1e-6 / kMostBounces);
  // The contact's own reaction: 6 on masses of 1 and 3; and a moving floor that comes up.
  EXPECT_DOUBLE_EQ(Two(elastic, {{0, 0}, {0, 0}}).resting(kPair, 6), std::sqrt(2 * 8 * kRestingGap * 1.0));
}

TEST(RestingSpeed, OfFastSpheresUnderPressureIsTheRounding) {
  const Two pressed({{"restitution", 1.0}}, {{0, 0}, {0, -2}});
  EXPECT_DOUBLE_EQ(pressed.resting(kPair, 0, {1e8, 0}), kRounding * (2e8 + 0.2));
}

TEST(RestingSpeed, AFloorThatComesUpPresses) {
  Two lifted({{"restitution", 1.0}}, {{0, 0}, {0, 0}});
  lifted.system->box.add({.name = "y-", .amplitude = 0.1, .frequency = 1, .turns = 0.75});  // lowest at the start
  lifted.system->box.begin_step(0, 0.1);
  const double up = lifted.system->box.wall(2).acceleration;
  ASSERT_GT(up, 0);
  EXPECT_DOUBLE_EQ(lifted.resting(kFloor), std::sqrt(2 * up * kRestingGap * 0.4));
}

TEST(RestingSpeed, NothingRestsOnAThermalWall) {
  Two hot({{"restitution", 0.5}}, {{0, -1}, {0, -1}});
  hot.system->box.add({.name = "y-", .temperature = 2.0});
  const RestLimits limits = hot.limits(kFloor);
  EXPECT_LT(limits.resting, 0);
  EXPECT_EQ(limits.stopping, limits.resting);
  EXPECT_EQ(limits.holding, limits.resting);
  EXPECT_EQ(limits.next(0), Next::hits);  // the wall gives it a velocity
  EXPECT_EQ(hot.rest_speed(kFloor), 0);
}

TEST(StoppingSpeed, KicksStopOnlyWhatHasALaw) {
  Two elastic({{"between", std::vector<std::string>{"*", "y-"}}, {"restitution", 0.5}}, {{0, 0}, {0, -2}});
  elastic.criterion->stop_within(0.1);
  EXPECT_EQ(elastic.limits(kPair).stopping, elastic.resting(kPair));
  EXPECT_EQ(elastic.limits(kPair).holding, elastic.resting(kPair));
}

TEST(HoldingSpeed, IsThatOfABounceWithinTheStep) {
  Two falls({{"restitution", 0.5}, {"rest_speed", 0.05}}, {{0, 0}, {0, -2}});
  const auto holding = [&] { return falls.limits(kPair).holding; };
  EXPECT_DOUBLE_EQ(holding(), 0.05);  // the rest speed
  falls.criterion->begin_step(&falls.a, 0.01);
  EXPECT_DOUBLE_EQ(holding(), 0.5 * 2 * 0.01);  // a flight that takes the whole step
  falls.criterion->let_open();
  EXPECT_EQ(holding(), falls.resting(kPair));
}

TEST(RestSpeed, FallingBackPressesAContactOnce) {
  Two falls({{"restitution", 0.5}, {"rest_speed", 0.05}}, {{0, 0}, {0, 0}});
  const Vec<2> n = falls.normal(kPair);
  const auto holding = [&] { return falls.limits(kPair).holding; };
  EXPECT_EQ(holding(), 0);  // nothing presses
  EXPECT_EQ(falls.limits(kPair).next(1e-9), Next::parts);
  EXPECT_FALSE(falls.criterion->falls_back(kPair, n, 0, 0.01));
  EXPECT_FALSE(falls.criterion->falls_back(kPair, n, 2, 0.06));
  EXPECT_TRUE(falls.criterion->falls_back(kPair, n, 2, 0.04));
  EXPECT_FALSE(falls.criterion->falls_back(kPair, n, 2, 0.04));
  EXPECT_DOUBLE_EQ(holding(), 0.05);
  falls.criterion->begin_step(&falls.a, 0.1);
  EXPECT_EQ(holding(), 0);
}

TEST(RestLimits, DivideTheSpeedsIntoFour) {
  const RestLimits limits{.resting = 1, .stopping = 3, .holding = 2};
  EXPECT_EQ(limits.next(-3.1), Next::hits);
  EXPECT_EQ(limits.next(-3), Next::stops);
  EXPECT_EQ(limits.next(-1.1), Next::stops);
  EXPECT_EQ(limits.next(-1), Next::rests);
  EXPECT_EQ(limits.next(2), Next::rests);
  EXPECT_EQ(limits.next(2.1), Next::parts);
}

}  // namespace
}  // namespace carom::rest_speed_test
