// SPDX-License-Identifier: BSD-3-Clause
// Methods that choose their steps: edda and cdda.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "engine/run/simulation.h"
#include "tests/support/experiments.h"

namespace carom::adaptive_steps_test {
namespace {

/// Two bodies on an eccentric orbit (e = 0.9, semi-major axis 1, period 2π), with cores that do not touch.
std::unique_ptr<System<2>> kepler() {
  auto system = test::make_system<2>(Vec<2>{20, 20}, Boundary::open, {{10.95, 10}, {9.05, 10}},
                                     {{0, 0.5 * std::sqrt(0.1 / 1.9)}, {0, -0.5 * std::sqrt(0.1 / 1.9)}}, {0.02, 0.02},
                                     {0.5, 0.5});
  test::add_interaction(*system, "gravity", {{"constant", 1.0}});
  return system;
}

Vec<2> separation(const Simulation<2>& run) {
  const auto& x = run.system().particles.x;
  return x[0] - x[1];
}

double energy_error(const Statistics& s) { return s.max_energy_error / s.energy_reference; }

struct Method {
  const char* name;
  double period = 6.283185307179586;
  std::unique_ptr<Simulation<2>> fly(const test::Given& given) const {
    auto run = test::make_run<2>(kepler(), name, {.end_time = 2 * period}, given);
    run->run();
    return run;
  }
};

class AdaptiveSteps : public testing::TestWithParam<const char*> {};

TEST_P(AdaptiveSteps, AreCheaperThanFixedOnesAtTheSameErrorAndOfOrderTwo) {
  const Method method{GetParam()};
  const Vec<2> exact{1.9, 0};
  const auto fixed = method.fly({{"step", method.period / 1536}});
  const auto adaptive = method.fly({{"accuracy", 1e-4}}), finer = method.fly({{"accuracy", 1e-4 / 64}});
  const double error = (separation(*adaptive) - exact).norm(), finer_error = (separation(*finer) - exact).norm();
  EXPECT_LT(error, (separation(*fixed) - exact).norm());
  EXPECT_LT(3 * adaptive->statistics().force_passes, fixed->statistics().force_passes);
  // Steps that are four times shorter: the error falls by 16.
  const auto steps = [](const auto& run) { return static_cast<double>(run->statistics().steps); };
  EXPECT_NEAR(steps(finer) / steps(adaptive), 4, 0.5);
  EXPECT_NEAR(std::log2(error / finer_error), 4, 1);
  for (const auto* run : {adaptive.get(), finer.get()}) {
    const Statistics& s = run->statistics();
    EXPECT_LT(energy_error(s), 1e-11);  // rounding of positions near the pericentre
    EXPECT_GT(s.longest_step, 8 * s.shortest_step);
    EXPECT_EQ(s.end_time, 2 * method.period);
    EXPECT_LE(s.local_error, 8 * 1e-4);
  }
}

/// Two discs that fly until they feel each other, so that nothing foretells the force.
TEST_P(AdaptiveSteps, AreRepeatedWhereAForceBegins) {
  auto system =
      test::make_system<2>(Vec<2>{100, 100}, Boundary::open, {{20, 50}, {80, 50.3}}, {{1, 0}, {-1, 0}}, {0.5, 0.5});
  test::add_interaction(*system, "yukawa", {{"amplitude", 5.0}, {"kappa", 1.0}, {"cutoff", 4.0}});
  auto run = test::make_run<2>(std::move(system), GetParam(), {.end_time = 60}, {{"accuracy", 1e-4}});
  run->run();
  const Statistics& s = run->statistics();
  EXPECT_GT(s.counters.steps_rejected, 0);
  EXPECT_EQ(s.longest_step, 1);  // a quarter of the range, at a speed of 1
  EXPECT_LE(s.local_error, 8e-4);
  EXPECT_LT(energy_error(s), 1e-12);
  EXPECT_EQ(s.counters.sphere_sphere, 0);
  // The discs turn round: their speeds are those at the start, but for the mean force over each step.
  EXPECT_NEAR(run->system().particles.v[0].norm(), 1, 1e-3);
  EXPECT_LT(run->system().particles.v[0][0], 0);
}

TEST_P(AdaptiveSteps, KeepToTheirBounds) {
  const Method method{GetParam()};
  const auto run = method.fly({{"accuracy", 1e-4}, {"longest_step", 0.01}, {"shortest_step", 1e-6}});
  EXPECT_LE(run->statistics().longest_step, 0.01);
  EXPECT_GT(run->statistics().longest_step, 0.005);
  try {
    method.fly({{"step", 0.1}, {"accuracy", 1e-6}, {"shortest_step", 0.05}});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.failure(), Failure::numerical);
    EXPECT_NE(std::string(error.what()).find("particle 0"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("shortest_step"), std::string::npos) << error.what();
  }
}

TEST_P(AdaptiveSteps, StopAndGoOnWithTheSameBits) {
  const Method method{GetParam()};
  const test::Given given{{"accuracy", 1e-5}};
  const auto whole = method.fly(given);
  auto halves = test::make_run<2>(kepler(), method.name, {.end_time = 2 * method.period}, given);
  int looks = 0;
  bool leave = false;
  const Simulation<2>::Hooks hooks{
      .should_stop = [&] { return leave; }, .leave = [&] { return leave = ++looks % 400 == 0; }, .left = [] {}};
  int stops = 0;
  do {
    leave = false;
    halves->run(hooks);
    stops += halves->statistics().stopped_early ? 1 : 0;
  } while (halves->statistics().stopped_early);
  EXPECT_GT(stops, 2);
  EXPECT_EQ(halves->statistics().steps, whole->statistics().steps);
  EXPECT_EQ(separation(*halves), separation(*whole));
  EXPECT_EQ(halves->statistics().counters.steps_rejected, whole->statistics().counters.steps_rejected);
}

INSTANTIATE_TEST_SUITE_P(Methods, AdaptiveSteps, testing::Values("edda", "cdda"));

TEST(StepsOfTheirOwn, AreLimitedByShakenWallsAndBaths) {
  const auto longest = [](auto&& change) {
    auto system =
        test::make_system<2>(Vec<2>{10, 10}, Boundary::wall, {{3, 5}, {7, 5}}, {{0.1, 0}, {0, 0.1}}, {0.5, 0.5});
    change(*system);
    auto run = test::make_run<2>(std::move(system), "edda", {.end_time = 40}, {{"accuracy", 1e-4}});
    run->run();
    return run->statistics().longest_step;
  };
  EXPECT_GT(longest([](auto&) {}), 4);
  EXPECT_EQ(longest([](auto& system) { system.box.add({.name = "y-", .amplitude = 0.1, .frequency = 0.4}); }), 0.25);
  EXPECT_EQ(longest([](auto& system) {
              system.box.bath = {.type = Bath::Type::andersen, .temperature = 1, .last_temperature = 1, .rate = 0.2};
            }),
            0.5);
}

/// Two discs that attract and hold each other move slowly together: nothing changes but their place. A force of 1 would
/// move a disc at rest by a quarter of the edge in the longest step.
TEST(StepsOfTheirOwn, DoNotGrowWithoutEndWhereForcesHoldSpheres) {
  for (const char* method : {"edda", "cdda"}) {
    SCOPED_TRACE(method);
    auto system = test::make_system<2>(Vec<2>{18, 18}, Boundary::open, {{9, 9}, {10, 9}}, {{1e-3, 0}, {1e-3, 0}});
    test::add_interaction(*system, "gravity", {{"constant", 1.0}});
    auto run = test::make_run<2>(std::move(system), method, {.end_time = 200}, {{"accuracy", 1e-4}});
    run->run();
    EXPECT_LE(run->statistics().longest_step, std::sqrt(2 * 18 / 4.0));
    EXPECT_GT(run->statistics().longest_step, 1);
    EXPECT_NEAR(run->system().particles.x[0][0], 9.2, 1e-12);
  }
}

TEST(StepsOfTheirOwn, AreRefusedByMethodsWhoseEnergyErrorWouldGrow) {
  for (const char* method : {"psa", "cva", "mcva", "verlet"}) {
    try {
      const auto run = test::make_run<2>(kepler(), method, {.step = 0.1, .accuracy = 1e-4, .steps = 1});
      FAIL() << method;
    } catch (const Error& error) {
      EXPECT_EQ(error.failure(), Failure::deck);
      EXPECT_NE(std::string(error.what()).find("edda"), std::string::npos) << error.what();
    }
  }
}

TEST(StepsOfTheirOwn, BeginWithoutAMotion) {
  auto system = test::make_system<2>(Vec<2>{10, 10}, Boundary::wall, {{3, 5}, {7, 5}}, {{0, 0}, {0, 0}}, {0.5, 0.5});
  test::add_interaction(*system, "gravity", {{"constant", 1.0}});
  auto run = test::make_run<2>(std::move(system), "edda", {.end_time = 20});
  run->run();
  EXPECT_GT(run->statistics().counters.sphere_sphere, 0);
  EXPECT_LT(energy_error(run->statistics()), 1e-12);
  EXPECT_LE(run->statistics().local_error, 8e-4);
}

/// A disc bounces off a wall and then, in the same step of cdda, meets the force of one that comes behind it.
TEST(StepsOfTheirOwn, AreRepeatedFromTheStateAtTheirStart) {
  for (const double ahead : {0.0, 0.25, 0.5, 0.75}) {
    const auto fly = [&](const test::Given& given) {
      auto system = test::make_system<2>(Vec<2>{100, 20}, Boundary::wall, {{20.7 + ahead, 10}, {24.9 + ahead, 10}},
                                         {{-1, 0}, {-1, 0}}, {0.5, 0.5});
      test::add_interaction(*system, "yukawa", {{"amplitude", 300.0}, {"kappa", 1.0}, {"cutoff", 4.0}});
      auto run = test::make_run<2>(std::move(system), "cdda", {.end_time = 23}, given);
      run->run();
      return run;
    };
    const auto run = fly({{"accuracy", 1e-4}}), fine = fly({{"step", 1e-3}});
    EXPECT_GT(run->statistics().counters.steps_rejected, 0u) << ahead;
    EXPECT_EQ(run->statistics().counters.sphere_wall, fine->statistics().counters.sphere_wall) << ahead;
    for (const Id i : {0, 1})
      EXPECT_LT((run->system().particles.x[i] - fine->system().particles.x[i]).norm(), 0.02) << ahead;
  }
}

/// A fluid of hard discs, in steps of several mean free times.
TEST(FixedSteps, AreDividedIfSpheresCollideOftenInThem) {
  const auto fly = [](double step) {
    auto system = test::hard_spheres<2>(6, 0.5);
    auto run = test::make_run<2>(std::move(system), "edda", {.step = step, .end_time = 8});
    run->run();
    return run;
  };
  const auto run = fly(4);
  const Statistics& s = run->statistics();
  EXPECT_EQ(s.steps, 2);
  EXPECT_EQ(s.end_time, 8);
  EXPECT_LT(energy_error(s), 1e-12);
  const double contacts =
      2.0 * static_cast<double>(s.counters.sphere_sphere) / static_cast<double>(run->system().size());
  EXPECT_GT(contacts, 8);
  // Half a contact of each sphere in a piece, or 32 contacts in all.
  const double wanted = std::max(0.5, 32.0 / static_cast<double>(run->system().size()));
  EXPECT_GT(static_cast<double>(s.counters.pieces), 0.7 * contacts / wanted);
  EXPECT_LT(static_cast<double>(s.counters.pieces), 4 * contacts / wanted);
}

/// A lattice of discs that fly side by side, without a collision, until the first ones hit a wall.
TEST(FixedSteps, AreRepeatedIfFarMoreSpheresCollideThanBefore) {
  std::vector<Vec<2>> x;
  for (int i = 0; i < 14; ++i)
    for (int k = 0; k < 14; ++k) x.push_back({20 + 1.01 * i, 3 + 1.01 * k});
  const std::size_t n = x.size();
  auto system = test::make_system<2>(Vec<2>{60, 20}, Boundary::wall, std::move(x), std::vector<Vec<2>>(n, {-5, 0}),
                                     std::vector<double>(n, 0.5));
  auto run = test::make_run<2>(std::move(system), "edda", {.step = 0.05, .end_time = 4.5});
  run->run();
  const Statistics& s = run->statistics();
  EXPECT_GT(s.counters.sphere_sphere, 1000u);
  EXPECT_GT(s.counters.slabs_halved, 0u);
}

}  // namespace
}  // namespace carom::adaptive_steps_test
