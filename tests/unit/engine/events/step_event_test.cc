// SPDX-License-Identifier: BSD-3-Clause
// Steps of the pair energy: when a pair reaches one, on which side it is, and what the event does.

#include "engine/events/step_event.h"

#include <gtest/gtest.h>

#include <random>

namespace carom::step_event_test {
namespace {

using V = Vec<3>;
constexpr double kTolerance = 1e-13, kSlack = 1e-15;

/// A well of two steps, 1.5 and 2 contact distances; the second with a tether instead of free space at 3.
PairSteps well(bool tethered = false) {
  PairSteps steps{{{.range = 1.5, .climb = 1}, {.range = 2, .climb = 0.5}}};
  if (tethered)
    steps.surfaces.push_back({.range = 3, .of_contact = false, .climb = std::numeric_limits<double>::infinity()});
  return steps;
}

TEST(StepEvent, TheSideFollowsFromTheDistanceAndAtAStepFromTheDirection) {
  const auto passed = [](double distance, double speed, bool tethered = false) {
    return steps_passed<3>(well(tethered), {{distance, 0, 0}, {speed, 1, 0}}, 1, kTolerance, kSlack);
  };
  EXPECT_EQ(passed(1.2, 1), 0U);
  EXPECT_EQ(passed(1.7, -1), 1U);
  EXPECT_EQ(passed(2.5, -1), 2U);
  for (const double rounding : {-1e-14, 0.0, 1e-14}) {
    EXPECT_EQ(passed(1.5 + rounding, -1), 0U);
    EXPECT_EQ(passed(1.5 + rounding, 1), 1U);
    EXPECT_EQ(passed(1.5 + rounding, 0), 1U) << "on a tangent it recedes";
    EXPECT_EQ(passed(3 + rounding, 1, true), 2U) << "no pair passes its tether";
  }
  EXPECT_EQ(passed(3.1, 1, true), 3U) << "another image is not tethered";
}

/// The first distance of a walk with small steps at which the pair changes its side, or touches.
double walked(const V& d, const V& v, const V& a, double end) {
  const auto shell = [&](double s) {
    const double r = (d + s * v + (0.5 * s * s) * a).norm();
    return r < 1 ? 0 : r < 1.5 ? 1 : r < 2 ? 2 : 3;
  };
  constexpr int kSteps = 4000;
  for (int k = 0; k < kSteps; ++k) {
    double lo = end * k / kSteps, hi = end * (k + 1) / kSteps;
    const int before = shell(lo);
    if (shell(hi) == before) continue;
    for (int bisection = 0; bisection < 80; ++bisection) (shell(0.5 * (lo + hi)) == before ? lo : hi) = 0.5 * (lo + hi);
    return hi;
  }
  return kNever;
}

TEST(StepEvent, TimesAreThoseOfAWalk) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  constexpr double kEnd = 3;
  int found = 0, none = 0;
  for (int trial = 0; trial < 600; ++trial) {
    const auto vector = [&](double size) {
      return V(size * uniform(random), size * uniform(random), size * uniform(random));
    };
    const V d = vector(2), v = vector(1), a = trial % 2 == 0 ? V(V::Zero()) : vector(1);
    if (d.norm() < 1.001) continue;
    const PairMotion<3> motion{d, v};
    const double walk = walked(d, v, a, kEnd);
    double s = trial % 2 == 0 ? next_step_time<3>(well(), d, v, 1, kTolerance, [] { return kSlack; })
                              : next_step_time<3>(well(), motion, a, 1, kEnd, kTolerance, kTolerance, kSlack);
    if (s >= kEnd) s = kNever;
    // The walk misses a surface that it touches for less than one of its steps.
    if (walk == kNever && s < kNever) continue;
    ++(walk < kNever ? found : none);
    if (s < walk - 1e-3) continue;
    if (walk == kNever) {
      EXPECT_EQ(s, kNever) << trial;
    } else {
      EXPECT_NEAR(s, walk, 1e-9) << trial;
    }
  }
  EXPECT_GT(found, 300);
  EXPECT_GT(none, 10);
}

/// After an event the pair leaves the step, and the next event is another one.
TEST(StepEvent, ThePairLeavesTheStepOnItsSide) {
  const PairSteps steps = well(true);
  for (const double bend : {0.0, 0.3}) {
    const V a(bend, -bend, 0);
    const auto next = [&](const V& d, const V& v) {
      return bend == 0 ? next_step_time<3>(steps, d, v, 1, kTolerance, [] { return kSlack; })
                       : next_step_time<3>(steps, {d, v}, a, 1, 10, kTolerance, kTolerance, kSlack);
    };
    for (const double range : {1.5, 2.0, 3.0}) {
      const V d(range, 0, 0);
      const double inwards = next(d, V(-0.5, 0.1, 0));
      EXPECT_GT(inwards, 0.1) << range;
      EXPECT_LT(inwards, 10) << range;
      if (range < 3) {
        EXPECT_GT(next(d, V(0.5, 0.1, 0)), 0.1) << range;
      } else {
        EXPECT_EQ(next(d, V(0.5, 0.1, 0)), 0) << "a tether turns the pair at once";
      }
    }
  }
}

TEST(StepEvent, ACrossingTakesExactlyItsEnergy) {
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> uniform(-1, 1);
  int crossed = 0, bounced = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const double range = 1.5, climb = trial % 3 == 0 ? 1e-9 : uniform(random), m_i = 0.5 + trial % 4, m_j = 1;
    const V d = range * V(uniform(random), uniform(random), uniform(random)).normalized();
    const V v_i(uniform(random), uniform(random), uniform(random)), v_j(uniform(random), uniform(random), 0);
    const auto met = step_impulse<3>({.range = range, .climb = climb}, {}, d, v_i - v_j, {m_i, 0.5, 0}, {m_j, 0.5, 0});
    const V after_i = v_i + met.factor / m_i * d, after_j = v_j - met.factor / m_j * d;
    const double before = d.dot(v_i - v_j), after = d.dot(after_i - after_j);
    const double gained =
        0.5 * (m_i * (after_i.squaredNorm() - v_i.squaredNorm()) + m_j * (after_j.squaredNorm() - v_j.squaredNorm()));
    EXPECT_NEAR(gained, -met.stored, 4e-15);  // K is up to 6
    if (met.event == PairEvent::bounce) {
      EXPECT_NEAR(after, -before, 1e-14);
      EXPECT_EQ(met.stored, 0);
      ++bounced;
    } else {
      EXPECT_EQ(met.event, before > 0 ? PairEvent::leave : PairEvent::enter);
      EXPECT_EQ(met.stored, before > 0 ? climb : -climb);
      EXPECT_GT(after * before, 0);
      ++crossed;
    }
  }
  EXPECT_GT(crossed, 500);
  EXPECT_GT(bounced, 300);
}

TEST(StepEvent, ATetherTurnsThePair) {
  const StepSurface tether{.range = 2, .of_contact = false, .climb = std::numeric_limits<double>::infinity()};
  const V d(2, 0, 0), v(0.5, 0.2, 0);
  const auto met = step_impulse<3>(tether, {}, d, v, {1, 0.5, 0}, {1, 0.5, 0});
  const V after = v + 2 * met.factor * d;
  EXPECT_NEAR(after[0], -0.5, 1e-15);
  EXPECT_EQ(after[1], 0.2);
  EXPECT_EQ(met.stored, 0);
  EXPECT_EQ(met.event, PairEvent::bounce);
}

/// The place of an event in a long epoch is rounded by more than positions are.
TEST(StepEvent, APairThatHasJustMetIsOnTheSideOfItsMotion) {
  const auto passed = [](double gap, double speed, bool just_met) {
    return steps_passed<3>(well(), {{1.5 + gap, 0, 0}, {speed, 1, 0}}, 1, side_tolerance(just_met, false, 1, 1e-14),
                           kSlack);
  };
  for (const double gap : {-1e-11, 1e-11}) {
    EXPECT_EQ(passed(gap, -1, true), 0U);
    EXPECT_EQ(passed(gap, 1, true), 1U);
    EXPECT_EQ(passed(gap, -1, false), gap < 0 ? 0U : 1U);
    EXPECT_EQ(passed(gap, 1, false), gap < 0 ? 0U : 1U);
  }
}

TEST(StepEvent, TheNearestDistanceSaysWhatIsReached) {
  const PairSteps steps = well();
  EXPECT_EQ(step_at(steps, 1.01, 1), nullptr);
  EXPECT_EQ(step_at(steps, 1.49, 1), &steps.surfaces[0]);
  EXPECT_EQ(step_at(steps, 4.01, 2), &steps.surfaces[1]);
}

TEST(Steps, KnowWhetherAllPairsHaveTheSame) {
  Steps steps;
  EXPECT_EQ(steps.of_all(), nullptr);
  steps.resize(2);
  const std::uint32_t list = steps.add(well());
  for (const auto& [one, other] : {std::pair{0, 0}, {0, 1}, {1, 1}}) {
    EXPECT_EQ(steps.of_all(), nullptr);
    steps.set_pair(one, other, list);
  }
  EXPECT_EQ(steps.of_all(), steps.of_species(0, 1));
  steps.bond(3, 4, list);
  EXPECT_EQ(steps.of_all(), nullptr);
}

TEST(Steps, BondsComeBeforeSpecies) {
  Steps steps;
  steps.resize(2);
  steps.set_pair(0, 1, steps.add(well()));
  PairSteps hard{{{.range = 1.2, .of_contact = false, .climb = std::numeric_limits<double>::infinity()}}, 0.9};
  const std::uint32_t list = steps.add(hard);
  steps.bond(7, 3, list);
  steps.bond(3, 4, list);
  EXPECT_EQ(steps.sort_bonds(), (std::array<Id, 2>{0, 0}));
  EXPECT_EQ(steps.find(3, 0, 7, 1)->core, 0.9);
  EXPECT_EQ(steps.find(7, 1, 3, 0)->core, 0.9);
  EXPECT_EQ(steps.find(4, 0, 7, 1)->core, 0);
  EXPECT_EQ(steps.find(4, 0, 7, 0), nullptr);
  EXPECT_EQ(steps.tethers(), 2U);
  EXPECT_EQ(steps.core_distance(4, 3, 1), 0.9);
  EXPECT_EQ(steps.core_distance(4, 7, 1), 1);
  EXPECT_EQ(steps.reach()(0.5), 1);
  EXPECT_EQ(steps.least_climb(), 0.5);
  steps.bond(4, 3, list);
  EXPECT_EQ(steps.sort_bonds(), (std::array<Id, 2>{3, 4}));
}

}  // namespace
}  // namespace carom::step_event_test
