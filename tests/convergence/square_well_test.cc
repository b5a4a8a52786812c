// SPDX-License-Identifier: BSD-3-Clause
// Square-well fluids of range 1.5: the second virial coefficient, and energies against Monte Carlo.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/setup/step_options.h"
#include "tests/support/experiments.h"

namespace carom::square_well_test {
namespace {

std::unique_ptr<Simulation<3>> fluid(int cells, double density, double temperature, double end_time) {
  auto system = test::hard_spheres<3>(cells, density * std::numbers::pi / 6);
  for (Vec<3>& v : system->particles.v) v *= std::sqrt(temperature);
  add_step<3>(system->box, system->species, system->size(),
              completed("step", step_parameters(),
                        {{"between", std::vector<std::string>{"*", "*"}}, {"range", 1.5}, {"depth", 1.0}}));
  system->box.bath = {
      .type = Bath::Type::andersen, .temperature = temperature, .last_temperature = temperature, .rate = 0.5};
  const double epoch = 4;
  return test::make_run<3>(std::move(system), "free-flight",
                           {.step = epoch, .end_time = end_time, .thermo_interval = epoch, .from_equilibrium = true});
}

/// B₂/b₀ = 1 − (λ³ − 1)(e^{1/T} − 1), b₀ = 2π/3; −3.081 at T = 1. The third coefficient changes Z − 1 by less than one
/// percent at this density.
TEST(SquareWell, ADiluteGasHasTheSecondVirialCoefficient) {
  constexpr double kDensity = 0.004;
  const auto run = fluid(8, kDensity, 1, 1500);
  run->run();
  const Estimate pressure = run->statistics().estimate(0);
  const double reduced = 1 - (1.5 * 1.5 * 1.5 - 1) * (std::exp(1.0) - 1);
  const double expected = reduced * 2 * std::numbers::pi / 3 * kDensity;
  EXPECT_LT(pressure.error / kDensity, 0.05 * std::abs(expected));
  EXPECT_NEAR(pressure.mean / kDensity - 1, expected, 4 * pressure.error / kDensity + 0.01 * std::abs(expected));
}

/// Energies of a sphere in 256 spheres at T = 1.5 by Metropolis Monte Carlo with an independent program of 30 lines in
/// C.
TEST(SquareWell, EnergiesAreThoseOfMonteCarlo) {
  for (const auto& [density, energy, error] : {std::array{0.5, -3.7905, 0.0011}, std::array{0.8, -5.9430, 0.0009}}) {
    const auto run = fluid(4, density, 1.5, 200);
    run->run();
    const Estimate potential = run->statistics().estimate(2);
    const double of_sphere = potential.mean / 256, own_error = potential.error / 256;
    EXPECT_LT(own_error, 0.015) << density;
    EXPECT_NEAR(of_sphere, energy, 4 * std::hypot(own_error, error)) << density;
    EXPECT_GT(run->statistics().counters.steps.events(), 50000U);
  }
}

}  // namespace
}  // namespace carom::square_well_test
