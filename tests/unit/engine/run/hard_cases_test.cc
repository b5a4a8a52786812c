// SPDX-License-Identifier: BSD-3-Clause
// Cases in which simple codes hang, overlap or lose energy: contacts that rest, graze, coincide or form chains.

#include <gtest/gtest.h>

#include <cmath>

#include "engine/base/error.h"
#include "engine/events/contact.h"
#include "engine/setup/placement.h"
#include "tests/support/experiments.h"

namespace carom::hard_cases_test {
namespace {

struct Method {
  std::string label;
  const char* name;
  Parameters given;
  double energy;  // the allowed relative energy error at step 0.01 in these cases
};

void PrintTo(const Method& method, std::ostream* out) { *out << method.label; }

class HardCases : public testing::TestWithParam<Method> {
 protected:
  template <int D>
  std::unique_ptr<Simulation<D>> run(std::unique_ptr<System<D>> system, double h, std::int64_t steps) {
    return test::run_steps<D>(std::move(system), GetParam().name, h, steps, GetParam().given);
  }

  template <int D>
  void expect_sane(const Simulation<D>& run) {
    const auto& s = run.statistics();
    EXPECT_LE(s.max_energy_error, GetParam().energy * s.energy_reference);
    EXPECT_LE(s.counters.max_overlap, 1e-12);
    const auto& system = run.system();
    EXPECT_EQ(find_overlaps<D>(system.box, system.particles.x, system.particles.radius).pairs, 0u);
    EXPECT_EQ(find_outsiders<D>(system.box, system.particles.x, system.particles.radius).spheres, 0u);
  }
};

std::unique_ptr<System<2>> gravitating(std::vector<Vec<2>> x, std::vector<Vec<2>> v) {
  auto system = test::make_system<2>({12, 12}, Boundary::wall, std::move(x), std::move(v));
  test::add_interaction(*system, "gravity", {{"constant", 1.0}});
  return system;
}

TEST_P(HardCases, TwoTouchingSpheresAtRestStayTogether) {
  auto result = run(gravitating({{5, 5}, {6, 5}}, {{0, 0}, {0, 0}}), 0.01, 500);
  expect_sane(*result);
  if (std::string(GetParam().name) == "psa") return;  // its kicks make discs bounce, to first order
  EXPECT_EQ(result->system().particles.x[0], Vec<2>(5, 5));
  EXPECT_EQ(result->statistics().counters.sphere_sphere, 0u);
}

TEST_P(HardCases, APressedChainThatMovesAsOneKeepsMoving) {
  auto result =
      run(gravitating({{3, 5}, {4, 5}, {5, 5}, {6, 5}}, std::vector<Vec<2>>(4, Vec<2>(0.5, 0.25))), 0.01, 500);
  expect_sane(*result);
  if (std::string(GetParam().name) == "psa") return;
  EXPECT_NEAR(result->system().particles.x[0][0], 5.5, 1e-11);
  EXPECT_NEAR(result->system().particles.x[3][1], 6.25, 1e-11);
}

TEST_P(HardCases, ABlowIntoAChainAtRestPassesThrough) {
  auto system =
      test::make_system<2>({20, 4}, Boundary::wall, {{2, 2}, {6, 2}, {7, 2}, {8, 2}}, {{1, 0}, {0, 0}, {0, 0}, {0, 0}});
  auto result = run(std::move(system), 0.01, 600);
  expect_sane(*result);
  EXPECT_NEAR(result->system().particles.x[3][0], 8 + 3, 1e-11);
  EXPECT_EQ(result->statistics().counters.sphere_sphere, 3u);
}

TEST_P(HardCases, ThreeBodiesMeetAtOneInstant) {
  // Three discs hit a fourth from three sides at the same time, by symmetry.
  const double s = std::sqrt(0.75);
  auto result =
      run(gravitating({{6, 6}, {8, 6}, {6 - 1, 6 + 2 * s}, {6 - 1, 6 - 2 * s}}, std::vector<Vec<2>>(4, Vec<2>::Zero())),
          0.01, 400);
  expect_sane(*result);
  EXPECT_GE(result->statistics().counters.sphere_sphere, 6u);
}

TEST_P(HardCases, ATurningPairInContactIsBraked) {
  // Two touching discs that circle each other, and a third that attracts them: the pair turns, is decelerated and is
  // pressed together.
  for (double h : {0.1, 0.01}) {
    auto system =
        test::make_system<2>({20, 20}, Boundary::open, {{10, 10}, {11, 10}, {10.3, 13}}, {{0, -0.6}, {0, 0.6}, {0, 0}});
    test::add_interaction(*system, "gravity", {{"constant", 4.0}});
    auto result = run(std::move(system), h, static_cast<std::int64_t>(3 / h));
    const auto& s = result->statistics();
    EXPECT_LE(s.counters.max_overlap, 1e-12) << "step " << h;
    EXPECT_LE(s.max_energy_error, (h < 0.1 ? 1 : 100) * GetParam().energy * s.energy_reference) << "step " << h;
  }
}

TEST_P(HardCases, GrazingPairsUnderAttraction) {
  // Pairs that pass at 1 ± a small distance: some touch with one step size and not with another.
  for (double miss : {-1e-3, -1e-6, -1e-9, -1e-12, 0.0, 1e-12, 1e-9, 1e-6, 1e-3}) {
    auto result = run(gravitating({{3, 5}, {9, 6.13 + miss}}, {{1, 0}, {-1, 0}}), 0.05, 300);
    const auto& s = result->statistics();
    EXPECT_LE(s.counters.max_overlap, 1e-12) << miss;
    EXPECT_LE(s.max_energy_error, 25 * GetParam().energy * s.energy_reference)
        << miss;  // the step is five times as long
  }
}

TEST_P(HardCases, APairDrawnTogetherBouncesWithoutEndAndWithoutLoss) {
  auto result = run(gravitating({{5, 6}, {7, 6}}, {{0, 0}, {0, 0}}), 0.01, 3000);
  expect_sane(*result);
  EXPECT_GT(result->statistics().counters.sphere_sphere, 5u);
}

TEST_P(HardCases, AContactAtTheVeryStartAndTheVeryEndOfAStep) {
  // Contact at t = 1, exactly at a step end; then at the wall, also at a step end.
  auto system = test::make_system<2>({8, 4}, Boundary::wall, {{2, 2}, {5, 2}}, {{1, 0}, {-1, 0}});
  auto result = run(std::move(system), 0.25, 40);
  expect_sane(*result);
  EXPECT_NEAR(std::abs(result->system().particles.v[0][0]), 1, 1e-12);
}

TEST_P(HardCases, UnequalRadiiAndMassesInACornerUnderAField) {
  auto system = test::make_system<3>(
      {4, 4, 4}, Boundary::wall, {{0.8, 0.8, 0.8}, {2.5, 1, 1}, {1, 2.7, 1.2}, {1.3, 1.2, 2.9}},
      {{0, 0, 0}, {-0.3, 0, 0}, {0, -0.4, 0.1}, {0.1, 0, -0.2}}, {0.8, 0.5, 0.3, 0.6}, {5, 1, 0.2, 2});
  test::add_interaction(*system, "uniform-field", {{"acceleration", std::vector<double>{-0.3, -0.2, -0.5}}});
  auto result = run(std::move(system), 0.01, 2000);
  const auto& s = result->statistics();
  EXPECT_LE(s.counters.max_overlap, 1e-12);
  // Spheres roll in the corner, with contacts much faster than the step: only the exact method must keep its order
  // here.
  if (GetParam().energy > 1e-12) return;
  EXPECT_LE(s.max_energy_error, GetParam().energy * s.energy_reference);
}

TEST_P(HardCases, ASmallPeriodicBoxMeetsItsOwnImages) {
  auto system = test::make_system<2>({2.2, 2.3}, Boundary::periodic, {{0.6, 0.6}, {1.7, 1.7}}, {{1, 0.3}, {-0.7, 0.9}});
  auto result = run(std::move(system), 0.01, 2000);
  const auto& s = result->statistics();
  EXPECT_GT(s.counters.sphere_sphere, 20u);
  EXPECT_LE(s.counters.max_overlap, 1e-12);
  EXPECT_LE(s.max_energy_error, 1e-12 * s.energy_reference);  // without forces every method is exact
  EXPECT_LE(*s.max_momentum_error, 1e-12);
}

TEST_P(HardCases, OneParticleAlone) {
  auto system = test::make_system<3>({3, 3, 3}, Boundary::wall, {{1, 1, 1}}, {{1, 0.7, -0.3}});
  auto result = run(std::move(system), 0.1, 500);
  expect_sane(*result);
  EXPECT_GT(result->statistics().counters.sphere_wall, 20u);
}

TEST_P(HardCases, MoreContactsThanAllowedNameTheParticles) {
  auto system = test::make_system<2>({5, 4}, Boundary::wall, {{1, 2}, {3, 2}}, {{50, 0}, {-50, 0}});
  try {
    Parameters given = GetParam().given;
    given.set("max_events_per_step", std::int64_t{8});
    test::run_steps<2>(std::move(system), GetParam().name, 1.0, 1, given);
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.failure(), Failure::numerical);
    EXPECT_NE(std::string(error.what()).find("particle"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("max_events_per_step = 8"), std::string::npos) << error.what();
  }
}

const std::vector<Method> kMethods = {
    {"psa", "psa", {}, 0.1},
    {"cva", "cva", {}, 3e-3},
    {"mcva_grid", "mcva", {}, 3e-3},
    {"mcva_restart", "mcva", {{"variant", std::string("restart")}}, 3e-3},
    {"cdda_order_2", "cdda", {}, 1e-13},
    {"cdda_order_4", "cdda", {{"order", std::int64_t{4}}}, 1e-13},
    {"edda", "edda", {}, 1e-13},
};

INSTANTIATE_TEST_SUITE_P(Methods, HardCases, testing::ValuesIn(kMethods),
                         [](const auto& test) { return test.param.label; });

}  // namespace
}  // namespace carom::hard_cases_test
