// SPDX-License-Identifier: BSD-3-Clause
// Charged hard spheres with Ewald sums: energy and momentum under each method, and the orders in the step.

#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <utility>

#include "engine/setup/placement.h"
#include "tests/support/experiments.h"

namespace carom::electrolyte_test {
namespace {

/// The restricted primitive model with n ions at this number density, l_B/d = 1.68, at random on fcc sites.
std::unique_ptr<System<3>> electrolyte(unsigned seed, const std::string& surface = "conducting", std::size_t n = 32,
                                       double density = 0.2) {
  Box<3> box;
  box.edges = Vec<3>::Constant(std::cbrt(static_cast<double>(n) / density));
  box.boundary.fill(Boundary::periodic);
  auto system = test::make_system<3>(box.edges, Boundary::periodic, lattice_sites<3>(Lattice::centred, box, n, 0.0),
                                     std::vector<Vec<3>>(n, Vec<3>::Zero()), std::vector<double>(n, 0.5),
                                     std::vector<double>(n, 1.0));
  const auto owner = distribute(n, std::vector<std::size_t>(2, n / 2), seed);
  std::vector<Id> all(n);
  for (Id i = 0; i < n; ++i) {
    all[i] = i;
    system->particles.charge[i] = owner[i] == 1 ? -1 : 1;
    system->particles.mass[i] = owner[i] == 1 ? 0.5 : 1;
  }
  draw_velocities<3>(system->particles, all, std::vector<double>(n, 1.0), seed);
  test::add_interaction(*system, "coulomb",
                        {{"constant", 1.68}, {"form", std::string("ewald")}, {"accuracy", 1e-4}, {"surface", surface}});
  return system;
}

TEST(Electrolyte, EddaKeepsEnergyAndMomentumThroughCollisions) {
  for (const char* surface : {"conducting", "vacuum"}) {
    const auto run =
        test::run_steps<3>(electrolyte(1, surface), "edda", 0.02, surface == std::string("vacuum") ? 400 : 3000);
    const auto& s = run->statistics();
    std::cout << surface << ": " << s.max_energy_error / s.energy_reference << ", momentum " << *s.max_momentum_error
              << ", collisions " << s.counters.sphere_sphere << '\n';
    EXPECT_LE(s.max_energy_error, 1e-12 * s.energy_reference);
    EXPECT_LE(*s.max_momentum_error, 1e-12);
    EXPECT_GT(s.counters.sphere_sphere, 300u);
  }
}

TEST(ElectrolyteSlow, EddaKeepsEnergyAndMomentumThroughAMillionCollisions) {
  const auto run = test::run_steps<3>(electrolyte(1, "conducting", 108, 0.5), "edda", 0.05, 100'000);
  const auto& s = run->statistics();
  std::cout << s.max_energy_error / s.energy_reference << ", momentum " << *s.max_momentum_error << ", collisions "
            << s.counters.sphere_sphere << '\n';
  EXPECT_LE(s.max_energy_error, 1e-12 * s.energy_reference);
  EXPECT_LE(*s.max_momentum_error, 1e-11);
  EXPECT_GT(s.counters.sphere_sphere, 1'000'000u);
}

TEST(Electrolyte, EveryOtherMethodRuns) {
  for (const char* method : {"psa", "cva", "mcva", "cdda"}) {
    const bool exact = method == std::string("cdda");
    const auto run = test::run_steps<3>(electrolyte(2), method, exact ? 0.01 : 0.002, exact ? 200 : 1000);
    const auto& s = run->statistics();
    std::cout << method << ": " << s.max_energy_error / s.energy_reference << ", collisions "
              << s.counters.sphere_sphere << '\n';
    EXPECT_LE(s.max_energy_error, (exact ? 1e-12 : 1e-3) * s.energy_reference) << method;
    EXPECT_LE(*s.max_momentum_error, 1e-12) << method;
    EXPECT_GT(s.counters.sphere_sphere, 30u) << method;
  }
}

TEST(Electrolyte, EnergyErrorsOfPsaAreOfFirstOrderAndOfCvaAndMcvaOfSecond) {
  const std::vector<double> steps = {0.02, 0.01, 0.005};
  for (const auto& [method, order] : {std::pair{"psa", 1.0}, {"cva", 2.0}, {"mcva", 2.0}}) {
    std::vector<double> errors;
    for (const double h : steps) {
      double logs = 0;
      for (unsigned k = 1; k <= 4; ++k)
        logs += std::log(test::run_until<3>(electrolyte(k), method, h, 1.0)->statistics().max_energy_error);
      errors.push_back(std::exp(logs / 4));
    }
    std::cout << method << ": order " << test::fitted_order(steps, errors) << '\n';
    EXPECT_NEAR(test::fitted_order(steps, errors), order, 0.3) << method;
  }
}

}  // namespace
}  // namespace carom::electrolyte_test
