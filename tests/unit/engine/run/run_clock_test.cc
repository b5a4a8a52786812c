// SPDX-License-Identifier: BSD-3-Clause
#include "engine/run/run_clock.h"

#include <gtest/gtest.h>

#include <limits>

#include "engine/run/simulation.h"

namespace carom::run_clock_test {
namespace {

/// A clock with a plan that runs without particles.
struct Journey {
  Plan plan;
  bool stepping = true;
  RunClock clock{plan, stepping, 10};
  Statistics s{};

  /// Runs a slab to its end, or up to `reached` within it.
  Slab slab(double reached = -1, std::uint64_t pairs = 0) {
    const Slab slab = clock.next_slab(s);
    s.counters.sphere_sphere += pairs;
    complete = clock.end_slab(slab, reached < 0 ? slab.length : reached, pairs, 0, 0, s);
    return slab;
  }
  double complete = 0;
};

TEST(RunClock, TheLastStepIsShortenedToEndOnTime) {
  Journey run{{.step = 0.1, .end_time = 0.35}};
  for (int n = 0; n < 3; ++n) {
    EXPECT_FALSE(run.clock.finished(run.s));
    EXPECT_EQ(run.slab().length, 0.1);
    EXPECT_EQ(run.s.end_time, (n + 1) * 0.1);
  }
  EXPECT_NEAR(run.slab().length, 0.05, 1e-15);
  EXPECT_EQ(run.s.end_time, 0.35);
  EXPECT_EQ(run.s.steps, 4);
  EXPECT_TRUE(run.clock.finished(run.s));
}

TEST(RunClock, AStepThatIsWholeButForRoundingIsWhole) {
  Journey run{{.step = 0.1, .end_time = 0.3}};  // 3 × 0.1 is above 0.3
  while (!run.clock.finished(run.s)) EXPECT_EQ(run.slab().length, 0.1);
  EXPECT_EQ(run.s.steps, 3);
}

TEST(RunClock, AnEpochThatStopsGoesOnWhereItStopped) {
  Journey run{.plan = {.step = 1, .collisions = 60}, .stepping = false};
  run.clock.limit_slabs(50);
  EXPECT_EQ(run.clock.next_slab(run.s).collision_limit, 50);
  EXPECT_EQ(run.clock.next_slab(run.s).contact_limit, 100);
  run.slab(0.25, 50);
  EXPECT_EQ(run.complete, 0);
  EXPECT_EQ(run.s.end_time, 0.25);
  const Slab rest = run.clock.next_slab(run.s);
  EXPECT_EQ(rest.index, 0);
  EXPECT_EQ(rest.start, 0.25);
  EXPECT_EQ(rest.length, 0.75);
  EXPECT_EQ(rest.collision_limit, 60);  // the end of the run
  run.slab(0.5, 10);
  EXPECT_TRUE(run.clock.finished(run.s));
  EXPECT_EQ(run.s.end_time, 0.75);
  EXPECT_EQ(run.s.steps, 1);
}

TEST(RunClock, EpochsHaveSeveralStepsAndKeepToTheEnd) {
  Journey run{.plan = {.step = 0.5, .steps = 10}, .stepping = false};
  run.slab();
  EXPECT_EQ(run.complete, 0.5);
  run.clock.lengthen(4);
  EXPECT_EQ(run.slab().length, 2);
  EXPECT_EQ(run.s.steps, 5);
  run.slab();
  EXPECT_EQ(run.slab().steps, 1);  // 10 − 9
  EXPECT_TRUE(run.clock.finished(run.s));
  EXPECT_EQ(run.s.end_time, 5);
}

TEST(RunClock, ARunThatGoesOnCountsFromTheShortenedStep) {
  Journey run{{.step = 0.1, .end_time = 0.25}};
  while (!run.clock.finished(run.s)) run.slab();
  run.plan.end_time = 0.5;
  run.clock.go_on(run.s);
  const Slab next = run.clock.next_slab(run.s);
  EXPECT_EQ(next.start, 0.25);
  EXPECT_EQ(next.length, 0.1);
  EXPECT_EQ(run.clock.time_after(4), 0.25 + 0.1);
}

TEST(RunClock, OnTheWayOfALongerRunAreWholeStepsOnly) {
  Journey run{{.step = 0.1, .end_time = 0.25}};
  EXPECT_FALSE(run.clock.is_last_on_the_way(run.s));  // the next step is whole, too
  run.slab();
  EXPECT_FALSE(run.clock.is_last_on_the_way(run.s));
  run.slab();
  EXPECT_TRUE(run.clock.is_last_on_the_way(run.s));  // the next one is shortened
  run.slab();
  EXPECT_FALSE(run.clock.is_last_on_the_way(run.s));
}

TEST(RunClock, TheNearestEndSaysHowMuchIsDone) {
  Journey run{{.step = 1, .steps = 10, .end_time = 40}};
  run.slab();
  run.slab();
  EXPECT_EQ(run.clock.fraction_done(run.s), 0.2);
}

/// A clock of a method that adapts.
struct Stroll : Journey {
  explicit Stroll(const Plan& wanted, double most_contacts = kNever, double contacts = 0) : Journey{wanted} {
    clock.expect(most_contacts, contacts, wanted.accuracy > 0 ? 0.1 : kNever);
  }
  static constexpr double kNever = std::numeric_limits<double>::infinity();
  double step(double rate, std::uint64_t contacts = 0) {
    const Slab slab = Journey::slab();
    clock.adapt(slab, {.rate = rate}, contacts, 10);
    return slab.length;
  }
};

TEST(RunClock, StepsFollowTheLocalErrorByAtMostAFactorOfTwoOrAQuarter) {
  Stroll run({.step = 0.1, .accuracy = 1e-3, .end_time = 100});
  EXPECT_EQ(run.step(1), 0.1);
  EXPECT_EQ(run.step(1), 0x1.6a09e667f3bcdp-4);  // 2^(−3.5): the largest power of 2^(1/4) below 0.1
  run.step(1e-6);
  EXPECT_EQ(run.clock.pace.length, 0x1.6a09e667f3bcdp-3);
  run.step(1e9);
  EXPECT_EQ(run.clock.pace.length, 0x1.6a09e667f3bcdp-5);
  run.step(0);
  EXPECT_EQ(run.clock.pace.length, 0x1.6a09e667f3bcdp-4);
  EXPECT_EQ(run.s.steps, 5);
  for (int n = 0; n < 10; ++n) run.step(0);
  EXPECT_EQ(run.clock.pace.length, 0x1.306fe0a31b715p3);  // 2^(3.25): the largest power below the longest step, 10
}

TEST(RunClock, TheEndOfARunDoesNotChangeTheLengthOfTheNextStep) {
  Stroll run({.step = 0.1, .accuracy = 1, .end_time = 0.12});
  run.step(1000);
  EXPECT_FALSE(run.clock.finished(run.s));
  EXPECT_TRUE(run.clock.is_last_on_the_way(run.s));
  const double before = run.clock.pace.length;
  EXPECT_NEAR(run.step(1000), 0.02, 1e-15);
  EXPECT_EQ(run.clock.pace.length, before);
  EXPECT_EQ(run.s.end_time, 0.12);
  EXPECT_TRUE(run.clock.finished(run.s));
  EXPECT_FALSE(run.clock.is_last_on_the_way(run.s));
}

TEST(RunClock, AStepThatWasTooLongIsRepeatedWithALengthOfItsOwn) {
  Stroll run({.step = 0.1, .accuracy = 1e-3, .shortest_step = 0.04, .end_time = 10});
  run.clock.shorten(run.clock.next_slab(run.s), {.length = 0.05, .id = 3});
  EXPECT_EQ(run.clock.next_slab(run.s).length, 0.05);
  run.clock.shorten(run.clock.next_slab(run.s), {.length = 0.025, .id = 3});
  EXPECT_EQ(run.clock.next_slab(run.s).length, 0.04);
  EXPECT_THROW(run.clock.shorten(run.clock.next_slab(run.s), {.length = 0.02, .id = 3}), Error);
}

TEST(RunClock, AStepHasAtMostSixtyFourParts) {
  Stroll run({.step = 1, .steps = 30}, 10, 1e6);
  const Slab slab = run.clock.next_slab(run.s);
  EXPECT_EQ(slab.length, 1.0 / 64);
  EXPECT_EQ(slab.most_contacts, std::numeric_limits<double>::infinity());
}

TEST(RunClock, FixedStepsAreDividedByTheNumberOfContacts) {
  Stroll run({.step = 1, .steps = 30}, 10, 20);  // of each of ten particles, as long as 2/20 units of time
  EXPECT_EQ(run.step(0, 1), 0.5);                // 200 are expected in a unit of time, 100 wanted
  EXPECT_EQ(run.complete, 0);
  EXPECT_EQ(run.s.steps, 0);
  EXPECT_EQ(run.step(0, 60), 0.5);
  EXPECT_EQ(run.complete, 1);
  EXPECT_EQ(run.s.steps, 1);
  EXPECT_EQ(run.step(0, 70), 1);  // 61 in a unit of time
  EXPECT_EQ(run.s.steps, 2);
  run.step(0, 350);
  EXPECT_NEAR(run.step(0, 90), 1.0 / 4, 1e-15);
}

}  // namespace
}  // namespace carom::run_clock_test
