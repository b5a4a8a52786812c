// SPDX-License-Identifier: BSD-3-Clause
// Standard errors predict how means scatter: a hundred independent short runs each of a hard-sphere fluid and of a
// fluid under forces, after their initial transients.
//
// χ² = Σ (m_i − m)²/e_i² of 100 means has 99 degrees of freedom, if the errors e_i are exact: 99 ± 14. An error from n
// blocks makes this (n − 1)/(n − 3) times as large, 1.03 to 1.18 for 64 to 14 blocks.

#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <map>

#include "engine/run/observable.h"
#include "tests/convergence/fluid.h"

namespace carom::standard_errors_test {
namespace {

constexpr unsigned kRuns = 100;

/// The estimates of many runs by their names.
class Scatter {
 public:
  void add(const std::string& name, double mean, double error) { all_[name].push_back({mean, error}); }
  void expect_errors_to_be_right() const {
    for (const auto& [name, estimates] : all_) {
      double mean = 0, weights = 0, chi_square = 0, of_squares = 0, n = 0;
      for (const auto& [value, error] : estimates)
        if (error > 0) mean += value / (error * error), weights += 1 / (error * error);
      mean /= weights;
      for (const auto& [value, error] : estimates) {
        if (!(error > 0)) continue;
        chi_square += (value - mean) * (value - mean) / (error * error);
        of_squares += error * error;
        n += 1;
      }
      std::cout << name << ": " << mean << ", error of a run " << std::sqrt(of_squares / n) << ", chi square "
                << chi_square << " of " << n << " runs" << std::endl;
      EXPECT_GE(n, 95) << name;
      EXPECT_GT(chi_square, 99 - 3 * 14) << name;
      EXPECT_LT(chi_square, 1.18 * 99 + 3 * 16) << name;
    }
  }

 private:
  std::map<std::string, std::vector<std::pair<double, double>>> all_;
};

void add_means(Scatter& scatter, const Statistics& s, std::initializer_list<const char*> names) {
  ASSERT_TRUE(s.equilibrium);
  for (std::size_t k = 0; k < Statistics::mean_names.size(); ++k)
    for (const std::string name : names)
      if (const Estimate e = s.series.estimate(k); name == Statistics::mean_names[k])
        scatter.add(name, e.mean, e.error);
}

TEST(StandardErrors, OfHardSpheres) {
  Scatter scatter;
  for (unsigned seed = 1; seed <= kRuns; ++seed) {
    auto run = test::make_run<3>(test::molten<3>(32, 0.3, seed), "free-flight",
                                 {.step = 0.25, .end_time = 60, .thermo_interval = 0.2, .from_equilibrium = true});
    const auto rdf = make_observable("rdf", run->system(), {{"interval", 0.5}, {"bins", 10}});
    const auto sk = make_observable("sk", run->system(), {{"interval", 0.5}, {"range", 6.0}, {"waves", 5}});
    const auto msd = make_observable("msd", run->system(), {{"interval", 0.25}});
    for (const auto& observable : {rdf.get(), sk.get(), msd.get()}) run->add(*observable);
    run->run();
    add_means(scatter, run->statistics(), {"pressure", "collision_rate", "mean_free_time"});
    const auto add = [&](const Observable<3>& observable, const std::string& name, std::size_t row) {
      double mean = 0, error = 0;
      for (const TableColumn& column : observable.table()) {
        if (column.name == name) mean = column.values[row];
        if (column.name == "error_" + name) error = column.values[row];
      }
      scatter.add(name + " " + std::to_string(row), mean, error);
    };
    add(*rdf, "g", 7);
    add(*sk, "S", 0);
    add(*msd, "msd", 3);
    const auto contact = rdf->species_values();
    scatter.add("contact value", contact.at(0).value, contact.at(0).error);
  }
  scatter.expect_errors_to_be_right();
}

TEST(StandardErrors, UnderForces) {
  Scatter scatter;
  for (unsigned seed = 1; seed <= kRuns; ++seed) {
    auto system = test::molten<2>(16, 0.3, seed);
    system->box.bath = {.type = Bath::Type::andersen, .temperature = 1, .last_temperature = 1, .rate = 3, .seed = seed};
    add_interaction(*system, "yukawa", {{"amplitude", 2.0}, {"kappa", 1.0}, {"cutoff", 1.9}});
    auto run = test::make_run<2>(std::move(system), "psa",
                                 {.step = 0.04, .steps = 3000, .thermo_interval = 0.2, .from_equilibrium = true});
    run->run();
    add_means(scatter, run->statistics(), {"pressure", "potential", "temperature"});
  }
  scatter.expect_errors_to_be_right();
}

}  // namespace
}  // namespace carom::standard_errors_test
