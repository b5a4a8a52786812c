// SPDX-License-Identifier: BSD-3-Clause
// Temperature, pressure and energies of a snapshot, by hand, in two and three dimensions; long-range corrections.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/experiments.h"

namespace carom::observables_test {
namespace {

template <int D>
struct Rows : Observer<D> {
  void thermo(const Snapshot<D>& shot) override { rows.push_back(shot); }
  std::vector<Snapshot<D>> rows;
};

/// Two particles of masses 1 and 3 on a spring of stiffness 2, stretched from 1 to 1.5: V = 0.25, d·F = −1.5. They move
/// with 2K = 1·(2² + 1²) + 3·1² = 8.
template <int D>
void expect_by_hand() {
  Vec<D> x = Vec<D>::Constant(2), v = Vec<D>::Zero(), w = Vec<D>::Zero(), y = x;
  y[1] += 1.5, v[0] = 2, v[1] = 1, w[1] = -1;
  auto system = test::make_system<D>(Vec<D>::Constant(5), Boundary::periodic, {x, y}, {v, w}, {}, {1.0, 3.0});
  test::add_interaction(*system, "harmonic-bond", {{"chain", true}, {"stiffness", 2.0}, {"rest_length", 1.0}});
  auto run = test::make_run<D>(std::move(system), "verlet", {.step = 1e-3, .steps = 1});
  Rows<D> observer;
  run->add(observer);
  run->run();
  const Snapshot<D>& first = observer.rows.front();
  EXPECT_DOUBLE_EQ(first.kinetic, 4);
  EXPECT_DOUBLE_EQ(first.potential, 0.25);
  EXPECT_DOUBLE_EQ(first.temperature, 8.0 / (D * 2));                    // 2K/(D N)
  EXPECT_DOUBLE_EQ(first.pressure, (8.0 - 1.5) / (D * std::pow(5, D)));  // (2K + Σ d·F)/(D V)
  EXPECT_NEAR(run->statistics().mean_pressure, first.pressure, 1e-3);
}

TEST(Observables, ByHandInTwoDimensions) { expect_by_hand<2>(); }
TEST(Observables, ByHandInThreeDimensions) { expect_by_hand<3>(); }

/// −1 for attraction, +1 for repulsion: two particles at rest at distance 1.5.
template <int D>
double pressure_at_rest(double amplitude) {
  Vec<D> x = Vec<D>::Constant(2), y = x;
  y[0] += 1.5;
  auto system = test::make_system<D>(Vec<D>::Constant(5), Boundary::open, {x, y}, {Vec<D>::Zero(), Vec<D>::Zero()});
  test::add_interaction(*system, "yukawa", {{"amplitude", amplitude}, {"kappa", 1.0}, {"charges", false}});
  auto run = test::make_run<D>(std::move(system), "verlet", {.step = 1e-9, .steps = 1});
  Rows<D> observer;
  run->add(observer);
  run->run();
  return observer.rows.front().pressure * D * std::pow(5, D) / (std::exp(-1.5) * (1 + 1.5) / 1.5);
}

TEST(Observables, RepulsionRaisesThePressureAndAttractionLowersIt) {
  EXPECT_NEAR(pressure_at_rest<2>(1), 1, 1e-12);
  EXPECT_NEAR(pressure_at_rest<3>(1), 1, 1e-12);
  EXPECT_NEAR(pressure_at_rest<2>(-1), -1, 1e-12);
}

TEST(Observables, LongRangeCorrectionsAreAddedToWhatIsShownAndToNothingElse) {
  const auto run = [](bool tail) {
    auto system = test::hard_spheres<3>(3, 0.3);
    test::add_interaction(
        *system, "lennard-jones",
        {{"epsilon", 1.0}, {"sigma", 1.0}, {"cutoff", 2.0}, {"cut", std::string("switch")}, {"tail", tail}});
    auto simulation = test::make_run<3>(std::move(system), "cdda", {.step = 0.005, .steps = 20});
    auto rows = std::make_unique<Rows<3>>();
    simulation->add(*rows);
    simulation->run();
    return std::pair(std::move(simulation), std::move(rows));
  };
  const auto [plain, plain_rows] = run(false);
  const auto [with, with_rows] = run(true);
  const Statistics &a = plain->statistics(), &b = with->statistics();
  EXPECT_EQ(plain->system().particles.x, with->system().particles.x);
  EXPECT_EQ(a.max_energy_error, b.max_energy_error);
  EXPECT_EQ(a.energy_reference, b.energy_reference);
  EXPECT_EQ(a.tail_energy, 0);
  EXPECT_LT(b.tail_energy, 0);
  EXPECT_NEAR(b.tail_pressure, b.tail_energy / with->system().box.volume(), 1e-14);
  EXPECT_NEAR(b.energy_final, a.energy_final + b.tail_energy, 1e-12);
  EXPECT_NEAR(b.mean_pressure, a.mean_pressure + b.tail_pressure, 1e-12);
  for (std::size_t k = 0; k < plain_rows->rows.size(); ++k) {
    const auto &p = plain_rows->rows[k], &w = with_rows->rows[k];
    EXPECT_NEAR(w.potential, p.potential + b.tail_energy, 1e-12);
    EXPECT_NEAR(w.pressure, p.pressure + b.tail_pressure, 1e-12);
    EXPECT_EQ(w.kinetic, p.kinetic);
  }
}

}  // namespace
}  // namespace carom::observables_test
