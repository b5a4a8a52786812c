// SPDX-License-Identifier: BSD-3-Clause
// Orders of convergence at a fixed end time, averaged over perturbed starts.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/experiments.h"

namespace carom::order_test {
namespace {

using test::Given;

template <int D>
using Start = std::unique_ptr<System<D>> (*)(unsigned);

/// The order in the step of the largest energy error (or shadow energy error) up to `end`: the slope of the mean of log
/// errors over 16 starts.
template <int D>
double energy_order(Start<D> start, const char* method, double end, bool shadow, const Given& given = {}) {
  std::vector<double> steps = {0.03, 0.01, 0.003, 0.001}, errors;
  for (double h : steps) {
    double logs = 0;
    for (unsigned k = 1; k <= 16; ++k) {
      const auto run = test::run_until<D>(start(k), method, h, end, given);
      const auto& s = run->statistics();
      logs += std::log(shadow ? *s.max_shadow_energy_error : s.max_energy_error);
    }
    errors.push_back(std::exp(logs / 16));
  }
  return test::fitted_order(steps, errors);
}

TEST(Order, EnergyErrorsInTwoDimensions) {
  for (Start<2> start : {Start<2>(test::five_springs), Start<2>(test::nine_gravity)}) {
    EXPECT_NEAR(energy_order<2>(start, "psa", 6, false), 1, 0.3);
    EXPECT_NEAR(energy_order<2>(start, "cva", 6, false), 2, 0.2);
    EXPECT_NEAR(energy_order<2>(start, "mcva", 6, false), 2, 0.2);
  }
}

TEST(Order, EnergyErrorsInThreeDimensions) {
  for (Start<3> start : {Start<3>(test::bonded_cluster), Start<3>(test::gravity_cluster)}) {
    EXPECT_NEAR(energy_order<3>(start, "psa", 6, false), 1, 0.3);
    EXPECT_NEAR(energy_order<3>(start, "cva", 6, false), 2, 0.2);
    EXPECT_NEAR(energy_order<3>(start, "mcva", 6, false), 2, 0.2);
  }
}

TEST(Order, ShadowEnergyOfMcvaWithRestartIsFour) {
  for (Start<2> start : {Start<2>(test::five_springs), Start<2>(test::nine_gravity)})
    EXPECT_GE(energy_order<2>(start, "mcva", 6, true, {{"variant", std::string("restart")}}), 3.5);
}

TEST(Order, VerletWithoutContacts) {
  auto start = [] {
    auto system = test::five_springs();
    return system;
  };
  std::vector<double> steps = {0.04, 0.02, 0.01, 0.005}, energies, positions;
  const auto exact = test::run_until<2>(start(), "verlet", 1e-4, 1);
  for (double h : steps) {
    const auto run = test::run_until<2>(start(), "verlet", h, 1);
    energies.push_back(run->statistics().max_energy_error);
    positions.push_back(test::largest_difference(run->system().particles.x, exact->system().particles.x));
  }
  EXPECT_NEAR(test::fitted_order(steps, energies), 2, 0.1);
  EXPECT_NEAR(test::fitted_order(steps, positions), 2, 0.1);
}

/// The order of the position error at `end` against a run of order-4 cdda with a tiny step.
template <int D>
double position_order(Start<D> start, const char* method, double end, const std::vector<double>& steps,
                      const Given& given = {}) {
  double logs_of[8] = {};
  const int starts = 4;
  for (unsigned k = 0; k < starts; ++k) {
    const auto exact = test::run_until<D>(start(k), "cdda", steps.back() / 8, end, {{"order", std::int64_t{4}}});
    for (std::size_t s = 0; s < steps.size(); ++s) {
      const auto run = test::run_until<D>(start(k), method, steps[s], end, given);
      logs_of[s] += std::log(test::largest_difference(run->system().particles.x, exact->system().particles.x));
    }
  }
  std::vector<double> errors;
  for (std::size_t s = 0; s < steps.size(); ++s) errors.push_back(std::exp(logs_of[s] / starts));
  return test::fitted_order(steps, errors);
}

TEST(Order, PositionsOfTheSecondOrderMethods) {
  for (const char* method : {"cva", "mcva", "cdda", "edda"}) {
    EXPECT_NEAR(position_order<2>(test::five_springs, method, 6, {0.04, 0.02, 0.01, 0.005}), 2, 0.2) << method;
    EXPECT_NEAR(position_order<3>(test::bonded_cluster, method, 4, {0.04, 0.02, 0.01, 0.005}), 2, 0.3) << method;
  }
}

TEST(Order, PositionsOfEddaAreAsGoodAsThoseOfCdda) {
  const auto exact = test::run_until<2>(test::five_springs(), "cdda", 0.002, 6, {{"order", std::int64_t{4}}});
  const auto error = [&](const char* method, double h) {
    const auto run = test::run_until<2>(test::five_springs(), method, h, 6);
    return test::largest_difference(run->system().particles.x, exact->system().particles.x);
  };
  for (const double h : {0.1, 0.025, 0.00625}) EXPECT_NEAR(error("edda", h) / error("cdda", h), 1, 0.1) << h;
}

TEST(Order, PositionsOfMcvaWithRestartAreShownAtTheRightTime) {
  const Given restart = {{"variant", std::string("restart")}};
  EXPECT_NEAR(position_order<2>(test::five_springs, "mcva", 6, {0.04, 0.02, 0.01, 0.005}, restart), 2, 0.2);
}

TEST(Order, PositionsOfCddaOrderFourBetweenCollisions) {
  const Given four = {{"order", std::int64_t{4}}};
  // The first collision of five-springs is after t = 1.
  const auto early = test::run_until<2>(test::five_springs(), "cdda", 0.01, 0.9);
  ASSERT_EQ(early->statistics().counters.sphere_sphere + early->statistics().counters.sphere_wall, 0u);
  EXPECT_NEAR(position_order<2>(test::five_springs, "cdda", 0.9, {0.15, 0.1, 0.075, 0.05}, four), 4, 0.2);
}

TEST(Order, PositionsOfCddaOrderFourAcrossCollisions) {
  const Given four = {{"order", std::int64_t{4}}};
  const auto run = test::run_until<2>(test::five_springs(), "cdda", 0.01, 6);
  ASSERT_GE(run->statistics().counters.sphere_sphere + run->statistics().counters.sphere_wall, 4u);
  EXPECT_NEAR(position_order<2>(test::five_springs, "cdda", 6, {0.1, 0.05, 0.025, 0.0125}, four), 4, 0.3);
  EXPECT_NEAR(position_order<2>(test::nine_gravity, "cdda", 4, {0.04, 0.02, 0.01, 0.005}, four), 4, 0.4);
  EXPECT_NEAR(position_order<3>(test::bonded_cluster, "cdda", 4, {0.1, 0.05, 0.025, 0.0125}, four), 4, 0.4);
}

}  // namespace
}  // namespace carom::order_test
