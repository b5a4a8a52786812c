// SPDX-License-Identifier: BSD-3-Clause
// Lennard-Jones fluids against other programs: temperature, energy and pressure.
//
// Runs are at constant energy: they start as an fcc crystal at a temperature for which the melt comes near the required
// temperature, and are compared at their actual temperature. Temperatures are 2K/(3(N − 1)), because the momentum is
// zero; pressures NkT/V + Σ d·F/(3V). Error bars are standard errors from 10 blocks, which must be much longer than all
// correlations; with 9 degrees of freedom |t| > 5 has a probability of 7e-4.

#include <gtest/gtest.h>

#include <iostream>

#include "engine/setup/placement.h"
#include "tests/convergence/fluid.h"

namespace carom::lennard_jones_test {
namespace {

using test::Given;
using test::Mean;

/// Rows of T, V/N and P after a given time.
struct Rows : Observer<3> {
  Rows(double from, double volume) : from_(from), volume_(volume) {}
  void thermo(const Snapshot<3>& shot) override {
    if (shot.time < from_) return;
    const auto n = static_cast<double>(shot.particles->size());
    temperature.push_back(2 * shot.kinetic / (3 * (n - 1)));
    energy.push_back(shot.potential / n);
    pressure.push_back(shot.pressure + (n * temperature.back() - 2 * shot.kinetic / 3) / volume_);
  }
  std::vector<double> temperature, energy, pressure;

 private:
  double from_, volume_;
};

struct Length {
  double step, equilibration, end;
};

/// `cells` cubed unit cells of an fcc crystal at this density and temperature, melted.
Rows melted(int cells, double density, double temperature, const Given& end, const Length& length) {
  const auto n = static_cast<std::size_t>(4 * cells * cells * cells);
  Box<3> box;
  box.edges = commensurate_edges<3>(Lattice::centred, n, static_cast<double>(n) / density);
  box.boundary.fill(Boundary::periodic);
  auto system = test::make_system<3>(box.edges, Boundary::periodic, lattice_sites<3>(Lattice::centred, box, n, 0.0),
                                     std::vector<Vec<3>>(n, Vec<3>::Zero()));
  std::vector<Id> all(n);
  for (Id i = 0; i < n; ++i) all[i] = i;
  draw_velocities<3>(system->particles, all, std::vector<double>(n, temperature), 1);
  Given given = {{"epsilon", 1.0}, {"sigma", 1.0}};
  for (const auto& [name, value] : end.all()) given.set(name, value);
  test::add_interaction(*system, "lennard-jones", given);
  Rows rows(length.equilibration, box.volume());
  auto run = test::make_run<3>(std::move(system), "verlet",
                               {.step = length.step, .end_time = length.end, .thermo_interval = 4 * length.step});
  run->add(rows);
  run->run();
  return rows;
}

std::ostream& operator<<(std::ostream& out, const Mean& mean) { return out << mean.value << " ± " << mean.error; }

Mean mean_of(const std::vector<double>& y) { return test::blocked_mean(y, 0, 10); }

/// ρ = 0.8442, cut at 2.5 and shifted, from T = 1.44: LAMMPS, 4000 atoms, times 6 … 40, gives T = 0.698, V/N = −5.220,
/// P = 0.751 ± 0.006. `slack` is allowed in addition to five standard errors, for the system size and the rounded
/// digits.
void expect_lammps_state(int cells, const Length& length, double slack) {
  const Rows rows = melted(cells, 0.8442, 1.44, {{"cutoff", 2.5}, {"cut", std::string("shifted")}}, length);
  const Mean t = mean_of(rows.temperature), v = mean_of(rows.energy), p = mean_of(rows.pressure);
  std::cout << "    T " << t << ", V/N " << v << ", P " << p << '\n';
  EXPECT_NEAR(t.value, 0.698, 5 * t.error + slack);
  EXPECT_NEAR(v.value, -5.220, 5 * v.error + slack);
  EXPECT_NEAR(p.value, 0.751, 5 * std::hypot(p.error, 0.006) + 4 * slack);
  EXPECT_LE(t.error, 2 * slack);  // so that the comparison is meaningful
  EXPECT_LE(p.error, 10 * slack);
}

TEST(LennardJones, IsTheFluidOfLammps) {
  expect_lammps_state(5, {.step = 0.005, .equilibration = 4, .end = 20}, 0.003);
}
TEST(LennardJonesSlow, IsTheFluidOfLammps) {
  expect_lammps_state(10, {.step = 0.004, .equilibration = 6, .end = 40}, 0.001);
}

/// NIST Standard Reference Simulation Website, Lennard-Jones fluid, NVT Monte Carlo of 500 atoms truncated at 3σ with
/// long-range corrections: U/N and P at T = 0.85 and 0.90, with their standard deviations at 0.85.
struct NistState {
  double density, energy[2], pressure[2], energy_error, pressure_error;
  double at(const double (&values)[2], double temperature) const {
    return values[0] + (values[1] - values[0]) * (temperature - 0.85) / 0.05;
  }
};

/// Compares at the temperature of the run with the line through both temperatures of NIST: T is linear in V in a run,
/// so differences from the line can be averaged row by row.
void expect_nist_state(const NistState& state, double start_temperature, const Length& length) {
  const Rows rows =
      melted(5, state.density, start_temperature,
             {{"cutoff", 3.3}, {"cut", std::string("switch")}, {"switch_from", 3.0}, {"tail", true}}, length);
  std::vector<double> energy, pressure;
  for (std::size_t k = 0; k < rows.temperature.size(); ++k) {
    energy.push_back(rows.energy[k] - state.at(state.energy, rows.temperature[k]));
    pressure.push_back(rows.pressure[k] - state.at(state.pressure, rows.temperature[k]));
  }
  const Mean t = mean_of(rows.temperature), v = mean_of(energy), p = mean_of(pressure);
  std::cout << "    T " << t << ", U/N − NIST's " << v << ", P − NIST's " << p << '\n';
  EXPECT_NEAR(t.value, 0.875, 0.035);
  EXPECT_NEAR(v.value, 0, 5 * std::hypot(v.error, state.energy_error) + 0.003);  // g(r) is not quite 1 beyond 3σ
  EXPECT_NEAR(p.value, 0, 5 * std::hypot(p.error, state.pressure_error) + 0.02);
  EXPECT_LE(v.error, 0.01);
  EXPECT_LE(p.error, 0.06);
}

constexpr NistState kNist820 = {0.820, {-5.7947, -5.7456}, {0.55355, 0.82386}, 6e-4, 3e-3};
constexpr NistState kNist860 = {0.860, {-6.0305, -5.9753}, {1.2660, 1.5781}, 3e-4, 1.5e-3};

TEST(LennardJones, HasTheEnergyAndPressureOfNistAtDensity082) {
  expect_nist_state(kNist820, 1.66, {.step = 0.005, .equilibration = 3, .end = 13});
}
TEST(LennardJones, HasTheEnergyAndPressureOfNistAtDensity086) {
  expect_nist_state(kNist860, 1.785, {.step = 0.005, .equilibration = 3, .end = 13});
}

}  // namespace
}  // namespace carom::lennard_jones_test
