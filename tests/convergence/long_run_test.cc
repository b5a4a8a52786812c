// SPDX-License-Identifier: BSD-3-Clause
// Long runs: the energy of cdda drifts like a random walk of rounding errors, and no faster.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/experiments.h"

namespace carom::long_run_test {
namespace {

TEST(LongRunSlow, AMillionStepsOfBothExperiments) {
  for (auto start : {test::five_springs, test::nine_gravity}) {
    const auto run = test::run_steps<2>(start(0), "cdda", 0.01, 1000000);
    const auto& s = run->statistics();
    EXPECT_LE(s.max_energy_error, 1e-11 * s.energy_reference);
    EXPECT_LE(s.counters.max_overlap, 1e-12);
    EXPECT_GT(s.counters.sphere_sphere, 3000u);
  }
}

/// Records the energy at given intervals.
struct EnergyNotes : Observer<2> {
  void thermo(const Snapshot<2>& shot) override { energy.push_back(shot.total()); }
  std::vector<double> energy;
};

TEST(LongRun, TheEnergyErrorGrowsNoFasterThanTheRootOfTheSteps) {
  for (auto start : {test::five_springs, test::nine_gravity}) {
    const std::vector<double> steps = {1000, 4000, 16000, 64000};
    std::vector<double> squares(steps.size(), 0.0);
    const int starts = 16;
    for (unsigned k = 1; k <= starts; ++k) {
      auto run = test::make_run<2>(start(k), "cdda", {.step = 0.01, .steps = 64000, .thermo_interval = 10.0});
      EnergyNotes notes;
      run->add(notes);
      run->run();
      const double first = run->statistics().energy_after_first_step;
      for (std::size_t n = 0; n < steps.size(); ++n) {
        const double error = notes.energy.at(static_cast<std::size_t>(steps[n] / 1000)) - first;
        squares[n] += error * error;
      }
    }
    std::vector<double> rms;
    for (double s : squares) rms.push_back(std::sqrt(s / starts));
    // A random walk has exponent 0.5; with 16 starts the fitted exponent scatters by about 0.08. A bias would give 1.
    EXPECT_LE(test::fitted_order(steps, rms), 0.5 + 0.2);
    EXPECT_LE(rms.back(), 1e-12);
  }
}

}  // namespace
}  // namespace carom::long_run_test
