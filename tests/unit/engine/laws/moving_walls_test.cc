// SPDX-License-Identifier: BSD-3-Clause
// Walls at any angle, with two sides, and shaken ones.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/base/error.h"
#include "engine/events/shaken_contact.h"
#include "engine/forces/add_interaction.h"
#include "tests/support/experiments.h"
#include "tests/unit/engine/laws/contact_collector.h"

namespace carom::moving_walls_test {
namespace {

const std::vector<std::string> kMethods = {"free-flight", "psa", "cva", "mcva", "cdda", "edda"};

/// Discs bounce in a wedge under gravity: every contact is at a wall or between discs, and the energy stays.
TEST(FurtherWalls, DiscsInAWedgeKeepTheirEnergy) {
  for (const std::string& method : kMethods) {
    auto system =
        test::make_system<2>({10, 20}, Boundary::wall, {{4, 6}, {5.5, 9}, {5, 12}}, {{0.3, 0}, {0, 0}, {-0.2, 0}});
    system->box.add({.name = "left", .normal = {3, 4}, .offset = 15});  // through (5, 0)
    system->box.add({.name = "right", .normal = {-1, 1}, .offset = -5});
    add_interaction(*system, "uniform-field", {{"acceleration", std::vector<double>{0, -1}}});
    auto run = test::make_run<2>(std::move(system), method, {.step = 0.01, .end_time = 20, .events = true});
    test::ContactCollector log;
    run->add(log);
    run->run();
    const Statistics& s = run->statistics();
    std::array<int, 6> hits{};
    for (const auto& contact : log.all) {
      if (contact.key.kind != EventKind::wall) continue;
      ++hits[contact.key.hi];
      EXPECT_NEAR((contact.x_lo - contact.x_hi).norm(), 0.5, 1e-9) << method;
      const Vec<2> normal = run->system().box.wall(contact.key.hi).normal;
      EXPECT_NEAR(normal.dot(contact.impulse), contact.impulse.norm(), 1e-12) << method;
    }
    EXPECT_GT(hits[4], 5) << method;
    EXPECT_GT(hits[5], 5) << method;
    EXPECT_EQ(hits[2], 0) << method;  // the floor of the box is below the wedge
    const bool exact = method == "free-flight" || method == "edda" || method == "cdda";
    EXPECT_LT(s.max_energy_error, (exact ? 1e-12 : 1e-1) * s.energy_reference) << method;
  }
}

/// A partition that moves like a piston between two gases: it works on both sides.
TEST(FurtherWalls, APartitionActsOnBothSides) {
  for (const std::string& method : kMethods) {
    auto system = test::make_system<2>({12, 4}, Boundary::wall, {{2, 2}, {4, 1}, {8, 2}, {10, 3}},
                                       {{0.5, 0.3}, {-0.4, 0.1}, {0.6, -0.2}, {-0.5, 0.1}});
    system->box.add({.name = "partition", .normal = {1, 0}, .offset = 6, .velocity = 0.125, .one_sided = false});
    const auto run = test::run_until<2>(std::move(system), method, 0.1, 16);
    const auto& p = run->system().particles;
    const Statistics& s = run->statistics();
    for (const Id i : {0u, 1u}) EXPECT_LE(p.x[i][0], 6 + 0.125 * 16 - 0.5 + 1e-12) << method;
    for (const Id i : {2u, 3u}) EXPECT_GE(p.x[i][0], 6 + 0.125 * 16 + 0.5 - 1e-12) << method;
    EXPECT_LT(s.max_energy_error, 1e-13 * s.energy_reference) << method;
    EXPECT_NE(s.counters.work.value(), 0);
  }
}

/// A piston, or a shaken floor, stops at its time, in the middle of a step, and the ledger closes.
TEST(MovingWalls, StopAtTheirTime) {
  for (const std::string& method : kMethods)
    for (const bool shaken : {false, true}) {
      auto system = test::make_system<2>({12, 4}, Boundary::wall, {{2, 2}, {4, 1}, {8, 2}, {10, 3}},
                                         {{0.5, 0.3}, {-0.4, 0.1}, {0.6, -0.2}, {1.5, 0.1}});
      WallOptions<2> wall{.name = "x+", .until = 3.03};
      if (shaken) wall.amplitude = 0.5, wall.frequency = 0.1;
      if (!shaken) wall.velocity = 0.25;
      system->box.add(wall);
      const double place = shaken ? 0.5 * std::sin(2 * std::numbers::pi * 0.1 * 3.03) : 0.25 * 3.03;
      const auto at = [&](double time) {
        Box<2> box = system->box;
        box.begin_step(time, 0);
        return box.wall(1);
      };
      EXPECT_NE(at(3).velocity_at(0), 0);
      EXPECT_EQ(at(3.03).velocity_at(0), 0);
      EXPECT_NEAR(at(5).level(0), place - 12, 1e-14);
      auto run = test::make_run<2>(std::move(system), method, {.step = 0.1, .end_time = 16, .events = true});
      test::ContactCollector log;
      run->add(log);
      run->run();
      int hits = 0;
      for (const auto& contact : log.all)
        if (contact.key.kind == EventKind::wall && contact.key.hi == 1 && contact.key.time > 3.1) {
          ++hits;
          EXPECT_NEAR(contact.x_hi[0], 12 - place, 1e-12) << method;
        }
      EXPECT_GT(hits, 1) << method;
      const Statistics& s = run->statistics();
      EXPECT_LT(s.max_energy_error, 1e-13 * s.energy_reference) << method;
      EXPECT_NE(s.counters.work.value(), 0) << method;
    }
}

/// Steps that the method chooses end when the motion of a wall ends, so that it never moves at a mean speed.
TEST(MovingWalls, StopBetweenChosenSteps) {
  const auto end = [](const std::string& method, double accuracy) {
    auto system = test::make_system<2>({12, 4}, Boundary::wall, {{2, 2}, {10.2, 3}}, {{0.5, 0.3}, {0.3, 0.1}});
    system->box.add({.name = "x+", .velocity = 0.25, .until = 2.4});  // it meets the second disc at 2.36
    auto run = test::make_run<2>(std::move(system), method, {.step = 0.1, .accuracy = accuracy, .end_time = 6});
    run->run();
    EXPECT_NE(run->statistics().counters.work.value(), 0) << method;
    return run->system().particles.x[1];
  };
  const Vec<2> exact = end("free-flight", 0);
  for (const std::string method : {"edda", "cdda"}) EXPECT_LT((end(method, 1e-2) - exact).norm(), 1e-12) << method;
}

/// The motion of a wall that is over limits no step, and its oscillations are those that it has made.
TEST(MovingWalls, AreForgottenWhenTheyHaveStopped) {
  auto system = test::make_system<2>({12, 4}, Boundary::wall, {{2, 2}}, {{0.5, 0.3}});
  system->box.add({.name = "x+", .amplitude = 0.1, .frequency = 1e7, .until = 0});
  EXPECT_EQ(system->box.longest_step(), std::numeric_limits<double>::infinity());
  const auto run = test::run_until<2>(std::move(system), "edda", 0.1, 1000);
  EXPECT_GT(run->statistics().counters.sphere_wall, 20u);
}

/// The first contact against steps of 10⁻⁴.
TEST(ShakenContact, IsTheFirst) {
  int found = 0;
  for (int k = 0; k < 200; ++k) {
    const double u = 0.1 * (k % 20), w = 0.05 * (k / 20);
    const ShakenGap gap{
        .y = 0.31 + u, .v = 1.5 * w - 1, .a = 0.3 * w - 0.2, .amplitude = 0.3, .frequency = 0.7, .turns = w};
    if (gap.at(0) <= 0) continue;
    const double rest = 4, first = gap.first_contact(rest, false, 0);
    double tried = 0;
    while (tried < rest && gap.at(tried) > 0) tried += 1e-4;
    if (tried >= rest) {
      EXPECT_GE(first, rest - 1e-4) << k;
      continue;
    }
    ++found;
    EXPECT_NEAR(first, tried, 2e-4) << k;
    EXPECT_NEAR(gap.at(first), 0, 1e-14) << k;
    EXPECT_LT(gap.slope(first), 0) << k;
  }
  EXPECT_GT(found, 50);
}

/// A sphere at the wall that moves with it, or leaves it slowly, against steps of 10⁻⁵: pressed on, it touches at once;
/// otherwise it lifts off, and the next contact is found however soon it comes.
TEST(ShakenContact, IsTheFirstOfASphereThatTouches) {
  constexpr double kAmplitude = 0.3, kFrequency = 1.1, kOmega = 2 * std::numbers::pi * kFrequency, kRest = 1.5;
  int pressed = 0, soon = 0, later = 0;
  for (int k = 0; k < 120; ++k) {
    const double turns = (k % 40 + 0.5) / 40, departing = k % 3 == 0 ? 0.05 : 0;
    const double sine = kAmplitude * std::sin(2 * std::numbers::pi * turns);
    const ShakenGap gap{.y = sine,
                        .v = kOmega * kAmplitude * std::cos(2 * std::numbers::pi * turns) + departing,
                        .a = 4.0 * (k / 40) - 5,
                        .amplitude = kAmplitude,
                        .frequency = kFrequency,
                        .turns = turns};
    const double first = gap.first_contact(kRest, true, 1e-9);
    if (departing == 0 && gap.a + kOmega * kOmega * sine <= 0) {
      ++pressed;
      EXPECT_EQ(first, 0) << k;
      continue;
    }
    double tried = 1e-5;
    while (tried < kRest && !(gap.at(tried) <= 0 && gap.slope(tried) < 0)) tried += 1e-5;
    if (tried >= kRest) {
      EXPECT_GE(first, kRest - 2e-5) << k;
      continue;
    }
    ++(tried < 0.1 ? soon : later);
    EXPECT_NEAR(first, tried, 2e-5) << k;
  }
  EXPECT_GT(pressed, 20);
  EXPECT_GT(soon, 3);
  EXPECT_GT(later, 20);
}

/// A disc bounces on a shaken floor: each contact is at the floor, and the work is the energy gained.
TEST(ShakenWalls, WorkIsTheEnergyGained) {
  constexpr double kAmplitude = 0.2, kFrequency = 1.5;
  for (const std::string& method : kMethods) {
    auto system = test::make_system<2>({4, 50}, Boundary::wall, {{1, 1.5}, {2.5, 2}}, {{0, 0}, {0.2, 0}});
    system->box.add({.name = "y-", .amplitude = kAmplitude, .frequency = kFrequency});
    add_interaction(*system, "uniform-field", {{"acceleration", std::vector<double>{0, -1}}});
    auto run = test::make_run<2>(std::move(system), method, {.step = 0.01, .end_time = 20, .events = true});
    test::ContactCollector log;
    run->add(log);
    run->run();
    const Statistics& s = run->statistics();
    const bool exact = method == "free-flight" || method == "edda" || method == "cdda";
    int hits = 0;
    for (const auto& contact : log.all) {
      if (contact.key.kind != EventKind::wall || contact.key.hi != 2) continue;
      ++hits;
      const double floor = kAmplitude * std::sin(2 * std::numbers::pi * kFrequency * contact.key.time);
      EXPECT_NEAR(contact.x_hi[1], floor, method == "free-flight" ? 1e-12 : 1e-3) << method;
      EXPECT_NEAR(contact.x_lo[1] - contact.x_hi[1], 0.5, 1e-11) << method;
    }
    EXPECT_GT(hits, 4) << method;
    EXPECT_GT(std::abs(s.counters.work.value()), 0.1) << method;
    EXPECT_LT(s.max_energy_error, (exact ? 1e-12 : 1e-1) * s.energy_reference) << method;
  }
}

/// Before chaos sets in, the methods converge to free flight with order 2, psa with order 1.
TEST(ShakenWalls, MethodsConvergeToFreeFlight) {
  const auto end = [](const std::string& method, double h) {
    auto system = test::make_system<2>({4, 50}, Boundary::wall, {{1, 1.5}}, {{0.1, 0}});
    system->box.add({.name = "y-", .amplitude = 0.1, .frequency = 0.5});
    add_interaction(*system, "uniform-field", {{"acceleration", std::vector<double>{0, -1}}});
    return test::run_until<2>(std::move(system), method, h, 4)->system().particles.x[0];
  };
  const Vec<2> exact = end("free-flight", 100);
  for (const std::string method : {"cva", "mcva", "cdda", "edda"})
    EXPECT_LT((end(method, 0.005) - exact).norm(), 0.07 * (end(method, 0.02) - exact).norm() + 1e-12) << method;
  EXPECT_LT((end("psa", 0.002) - exact).norm(), 0.02);
}

/// Two discs rest on a floor that is shaken gently: they never leave it, and the floor does the work of lifting them.
TEST(ShakenWalls, CarryWhatLiesOnThem) {
  for (const std::string method : {"cdda", "edda"}) {
    auto system = test::make_system<2>({4, 9}, Boundary::wall, {{1.2, 0.5}, {2.4, 0.5}}, {{0, 0}, {0, 0}});
    Box<2>& box = system->box;
    box.add({.name = "y-", .amplitude = 0.1, .frequency = 0.1});
    box.begin_step(0, 0.05);
    for (Vec<2>& v : system->particles.v) v[1] = box.wall(2).velocity;
    add_interaction(*system, "uniform-field", {{"acceleration", std::vector<double>{0, -1}}});
    const auto run = test::run_until<2>(std::move(system), method, 0.05, 12.5);
    const Statistics& s = run->statistics();
    EXPECT_NEAR(run->system().particles.x[0][1], 0.6, 1e-4) << method;
    EXPECT_LT(s.max_energy_error, 1e-12 * s.energy_reference) << method;
    EXPECT_NEAR(s.counters.work.value(), s.energy_final - s.energy_initial, 1e-12) << method;
    EXPECT_LT(s.counters.sphere_wall, 20u) << method;
  }
}

/// The message of a run that is refused.
std::string refusal(const std::string& method, double step, const Parameters& given, double frequency = 2) {
  auto system = test::make_system<2>({4, 9}, Boundary::wall, {{1, 2}}, {{0, 0}});
  system->box.add({.name = "y-", .amplitude = 0.1, .frequency = frequency});
  try {
    test::run_until<2>(std::move(system), method, step, 1, given);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(ShakenWalls, AreRefusedWhereStepsDoNotFollowThem) {
  EXPECT_EQ(refusal("mcva", 0.01, {{"variant", std::string("restart")}}),
            "mcva with variant = \"restart\" knows no shaken walls; take variant = \"grid\"");
  EXPECT_EQ(
      refusal("edda", 0.06, {}),
      "the lower wall of axis 1 is shaken with the period 0.5, too short for steps of 0.06; take a step of at most "
      "0.05 (in step 1, from time 0)");
  EXPECT_EQ(refusal("edda", 0.05, {}), "");
  EXPECT_EQ(refusal("free-flight", 1, {}), "");
  EXPECT_EQ(refusal("free-flight", 1, {}, 1e12),
            "the lower wall of axis 1 would oscillate 1e+12 times until time 1, so often that its phase is lost to "
            "rounding; take a frequency of at most 1e+09, or end the run earlier (in step 1, from time 0)");
}

/// A piston that leaves a disc no room: an error that says so, in every method, at elastic and inelastic contacts.
TEST(Walls, ThatSqueezeASphereEndTheRun) {
  for (const std::string& method : kMethods)
    for (const double e : {1.0, 0.5}) {
      auto system = test::make_system<2>({4, 6}, Boundary::wall, {{1, 3}, {2.5, 3.1}}, {{0.3, 0.1}, {0, -0.2}});
      system->box.add({.name = "x+", .velocity = 1});
      test::set_law(*system, {{"restitution", e}});
      try {
        test::run_until<2>(std::move(system), method, 0.01, 5);
        ADD_FAILURE() << method;
      } catch (const Error& error) {
        EXPECT_EQ(error.failure(), Failure::numerical);
        const std::string what = error.what();
        EXPECT_NE(what.find("the lower wall of axis 0 and the upper wall of axis 0 leave no room for a diameter of 1 "
                            "between them at time 3"),
                  std::string::npos)
            << method << e << what;
      }
    }
}

TEST(Walls, NeedRoomBetweenThem) {
  Box<2> box{.edges = {10, 10}};
  box.add({.name = "x-", .velocity = 0.5});
  box.add({.name = "x+", .velocity = 0.5});
  EXPECT_NO_THROW(box.check(Failure::numerical));
  box.time = 10;
  try {
    box.check(Failure::numerical);
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(),
                 "the lower wall of axis 0 and the upper wall of axis 0 leave no room between them at time 10; move "
                 "them apart, or end the run before they meet");
  }
}

}  // namespace
}  // namespace carom::moving_walls_test
