// SPDX-License-Identifier: BSD-3-Clause
// Fluids of charges with Ewald sums against the literature: the restricted primitive model, the one-component plasma,
// and counter-ions between charged walls.
//
// A bath keeps the temperature 1, so that means are canonical. Means start after the initial transient.

#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <numbers>

#include "engine/setup/placement.h"
#include "tests/convergence/fluid.h"

namespace carom::ionic_fluids_test {
namespace {

/// n = 4 c³ particles of mass 1 at temperature 1 and this number density, on the sites of an fcc lattice; the charges
/// are 1, and −1 of a random half if there are two species.
std::unique_ptr<System<3>> ions(std::size_t n, double density, std::size_t species, double radius, double constant,
                                double accuracy) {
  Box<3> box;
  box.edges = Vec<3>::Constant(std::cbrt(static_cast<double>(n) / density));
  box.boundary.fill(Boundary::periodic);
  auto system = test::make_system<3>(box.edges, Boundary::periodic, lattice_sites<3>(Lattice::centred, box, n, 0.0),
                                     std::vector<Vec<3>>(n, Vec<3>::Zero()), std::vector<double>(n, radius));
  const auto owner = distribute(n, std::vector<std::size_t>(species, n / species), 1);
  std::vector<Id> all(n);
  for (Id i = 0; i < n; ++i) {
    all[i] = i;
    system->particles.charge[i] = owner[i] == 1 ? -1 : 1;
  }
  draw_velocities<3>(system->particles, all, std::vector<double>(n, 1.0), 1);
  test::add_interaction(*system, "coulomb",
                        {{"constant", constant}, {"form", std::string("ewald")}, {"accuracy", accuracy}});
  system->box.bath = {.type = Bath::Type::rescaling, .temperature = 1, .last_temperature = 1, .rate = 0.5};
  return system;
}

/// The means of a run from its equilibrium on.
struct Means {
  Estimate potential, pressure, temperature;
};

Means means_of(std::unique_ptr<System<3>> system, const char* method, double step, std::int64_t steps) {
  const auto run = test::make_run<3>(
      std::move(system), method, {.step = step, .steps = steps, .thermo_interval = 8 * step, .from_equilibrium = true});
  run->run();
  const Statistics& s = run->statistics();
  EXPECT_TRUE(s.equilibrium);
  Means means;
  for (std::size_t k = 0; k < Statistics::mean_names.size(); ++k) {
    if (Statistics::mean_names[k] == std::string("potential")) means.potential = s.series.estimate(k);
    if (Statistics::mean_names[k] == std::string("pressure")) means.pressure = s.series.estimate(k);
    if (Statistics::mean_names[k] == std::string("temperature")) means.temperature = s.series.estimate(k);
  }
  return means;
}

/// The restricted primitive model, d = 4.25 Å, l_B/d = 1.68: −U/NkT and p/ρkT of Monte Carlo runs of 64 and 200 ions,
/// Rasaiah, Card, Valleau, J. Chem. Phys. 56 (1972) 248, with their standard errors, as functions of the concentration.
struct PrimitiveModelState {
  double molar, energy, energy_error, pressure, pressure_error;

  friend std::ostream& operator<<(std::ostream& out, const PrimitiveModelState& state) {
    return out << state.molar << " M";
  }
};

void expect_primitive_model(const PrimitiveModelState& state, std::int64_t steps) {
  constexpr double kAvogadro = 6.02214076e23, kDiameter = 4.25e-10;  // metres
  constexpr std::size_t kIons = 108;
  const double density = 2 * 1000 * state.molar * kAvogadro * std::pow(kDiameter, 3);
  const Means means = means_of(ions(kIons, density, 2, 0.5, 1.68, 1e-4), "edda", 0.05, steps);
  const double energy = -means.potential.mean / kIons, energy_error = means.potential.error / kIons;
  const double pressure = means.pressure.mean / density, pressure_error = means.pressure.error / density;
  std::cout << state.molar << " M: -U/NkT " << energy << " +- " << energy_error << " (" << state.energy << " +- "
            << state.energy_error << "), p/rho kT " << pressure << " +- " << pressure_error << " (" << state.pressure
            << " +- " << state.pressure_error << ")" << std::endl;
  EXPECT_NEAR(energy, state.energy, 3 * std::hypot(energy_error, state.energy_error));
  EXPECT_NEAR(pressure, state.pressure, 3 * std::hypot(pressure_error, state.pressure_error));
  EXPECT_LE(energy_error, 0.02 * energy);
  EXPECT_LE(pressure_error, 0.02);
}

TEST(PrimitiveModel, HasTheEnergyAndPressureOfTheLiterature) {
  expect_primitive_model({1.0001, .5516, .0016, 1.094, .005}, 8000);
}
class PrimitiveModelSlow : public testing::TestWithParam<PrimitiveModelState> {};
TEST_P(PrimitiveModelSlow, HasTheEnergyAndPressureOfTheLiterature) { expect_primitive_model(GetParam(), 60000); }
INSTANTIATE_TEST_SUITE_P(All, PrimitiveModelSlow,
                         testing::Values(PrimitiveModelState{0.00911, .1029, .0013, .9701, .0008},
                                         PrimitiveModelState{0.10376, .2739, .0014, .9445, .0012},
                                         PrimitiveModelState{0.42502, .4341, .0017, .9774, .0046},
                                         PrimitiveModelState{1.0001, .5516, .0016, 1.094, .005},
                                         PrimitiveModelState{1.9676, .6511, .0020, 1.346, .009}),
                         [](const auto& test) { return "State" + std::to_string(test.index); });

/// The one-component plasma in units of the ion-sphere radius a = (3/4πρ)^(1/3), at Γ = q²/(4πε₀ a kT). The energy of
/// the fluid for Γ ≥ 1: U/NkT = aΓ + bΓ^(1/4) + cΓ^(−1/4) + d, a fit to Monte Carlo runs of 128 to 1024 ions (Slattery,
/// Doolen, DeWitt, Phys. Rev. A 26 (1982) 2255). From Γ = 10 to 100 such fits agree within 0.01.
void expect_plasma(double coupling, std::size_t n, std::int64_t steps) {
  const double density = 3 / (4 * std::numbers::pi), frequency = std::sqrt(3 * coupling),
               root = std::pow(coupling, 0.25);
  const Means means = means_of(ions(n, density, 1, 0, coupling, 1e-4), "verlet", 0.1 / frequency, steps);
  const double energy = means.potential.mean / static_cast<double>(n);
  const double error = means.potential.error / static_cast<double>(n);
  const double fit = -0.897744 * coupling + 0.95043 * root + 0.18956 / root - 0.81487;
  std::cout << "Gamma " << coupling << ": U/NkT " << energy << " +- " << error << " (" << fit << "), pU "
            << means.pressure.mean << " +- " << means.pressure.error << std::endl;
  EXPECT_NEAR(energy, fit, 3 * error + 0.01);
  EXPECT_LE(error, 0.02);
  // All potential energy is that of charges, so the virial is a third of it, but for the errors of the sums.
  EXPECT_NEAR(means.pressure.mean / density, means.temperature.mean + energy / 3, 1e-4 * (1 + std::abs(energy)));
}

TEST(OneComponentPlasma, HasTheEnergiesOfTheLiterature) {
  for (const double coupling : {1.0, 10.0}) expect_plasma(coupling, 108, 6000);
}
TEST(OneComponentPlasmaSlow, HasTheEnergiesOfTheLiterature) {
  for (const double coupling : {1.0, 10.0, 100.0}) expect_plasma(coupling, 500, 20000);
}

/// Where the ions are between the walls, and what they do to them.
struct BetweenWalls : Observer<3> {
  double edge;
  std::vector<double> spread, load;
  explicit BetweenWalls(double between) : edge(between) {}
  void thermo(const Snapshot<3>& shot) override {
    if (shot.time < 500) return;
    double sum = 0;
    for (const Vec<3>& x : shot.particles->x) sum += std::pow(2 * x[2] / edge - 1, 2);
    spread.push_back(sum / static_cast<double>(shot.particles->size()));
    load.push_back(0.5 * (std::abs(shot.walls[0].load()) + std::abs(shot.walls[1].load())));
  }
};

/// Weakly coupled ions between two walls of the opposite charge σ per area follow the Poisson–Boltzmann equation: their
/// density is K²/(2π l_B cos² Kz), z from the middle, K tan(KL/2) = 2π l_B σ. The density at a wall, times kT, is the
/// pressure on it. The coupling 2π l_B² σ is 0.02 here, and L is twice the Gouy–Chapman length 1/(2π l_B σ), where
/// KL/2 = 0.860334 (Moreira, Netz, Europhys. Lett. 52 (2000) 705).
TEST(CounterIons, BetweenChargedWallsFollowPoissonAndBoltzmann) {
  constexpr std::size_t kIons = 64;
  constexpr double kTwoPi = 2 * std::numbers::pi, kWall = 0.02 / kTwoPi, kEdge = 100, kHalf = 0.860333589;
  auto system = ions(kIons, 1e-4, 1, 0, 1, 1e-3);
  system->interactions.clear();
  const double side = std::sqrt(kIons / (2 * kWall));
  const Vec<3> edges(side, side, kEdge);
  for (Vec<3>& x : system->particles.x) x = x.cwiseQuotient(system->box.edges).cwiseProduct(edges);
  system->box.edges = edges;
  system->box.boundary[2] = Boundary::wall;
  test::add_interaction(*system, "coulomb",
                        {{"constant", 1.0},
                         {"form", std::string("ewald")},
                         {"accuracy", 1e-3},
                         {"wall_charges", std::vector<double>(2, -kWall)}});
  system->box.bath = {.type = Bath::Type::andersen, .temperature = 1, .last_temperature = 1, .rate = 0.02};
  BetweenWalls seen(kEdge);
  const auto run = test::make_run<3>(std::move(system), "edda", {.step = 1, .steps = 8000, .thermo_interval = 20});
  run->add(seen);
  run->run();
  double weight = 0, squares = 0;
  for (int k = 0; k < 1000; ++k) {
    const double s = (k + 0.5) / 1000, density = 1 / std::pow(std::cos(kHalf * s), 2);
    weight += density, squares += density * s * s;
  }
  const double at_wall = std::pow(2 * kHalf / kEdge, 2) / kTwoPi + kTwoPi * kWall * kWall;
  const test::Mean spread = test::blocked_mean(seen.spread, 0), load = test::blocked_mean(seen.load, 0);
  std::cout << "spread " << spread.value << " +- " << spread.error << " (" << squares / weight
            << "), pressure on the walls " << load.value << " +- " << load.error << " (" << at_wall << ")\n";
  EXPECT_NEAR(spread.value, squares / weight, 3 * spread.error + 0.01 * spread.value);
  EXPECT_NEAR(load.value, at_wall, 3 * load.error + 0.01 * load.value);
  EXPECT_LE(spread.error, 0.02 * spread.value);
  EXPECT_LE(load.error, 0.03 * load.value);
}

}  // namespace
}  // namespace carom::ionic_fluids_test
