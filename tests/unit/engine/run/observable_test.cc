// SPDX-License-Identifier: BSD-3-Clause
// Observables by their names: all declared ones, and the profile.

#include "engine/run/observable.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "engine/base/error.h"
#include "engine/base/random.h"
#include "tests/support/experiments.h"

namespace carom::observable_test {
namespace {

template <int D>
void expect_tables_of_all() {
  const auto system = test::hard_spheres<D>(3, 0.3);
  for (const ObservableInfo& info : observables()) {
    EXPECT_EQ(&find_observable(info.name), &info);
    const auto average = make_observable(info.name, *system, {{"interval", 0.5}}, 2);
    EXPECT_EQ(average->sampling().interval, 0.5) << info.name;
    EXPECT_EQ(average->sampling().start, 2) << info.name;
    for (int n = 0; n < 3; ++n) average->sample(n, system->particles);
    EXPECT_EQ(average->samples(), 3u);
    const auto table = average->table();
    ASSERT_GE(table.size(), 2u) << info.name;
    EXPECT_FALSE(table[0].values.empty()) << info.name;
    for (const TableColumn& column : table) EXPECT_EQ(column.values.size(), table[0].values.size()) << column.name;
  }
}

TEST(Observable, EachHasATable) {
  expect_tables_of_all<2>();
  expect_tables_of_all<3>();
}

std::string error_of(std::string_view name, const System<2>& system, Parameters given) {
  try {
    make_observable(name, system, std::move(given));
  } catch (const Error& e) {
    EXPECT_EQ(e.failure(), Failure::deck);
    return e.what();
  }
  return {};
}

TEST(Observable, ErrorsSayWhatToDo) {
  auto system = test::hard_spheres<2>(3, 0.3);
  EXPECT_EQ(error_of("profil", *system, {}),
            "unknown observable 'profil'; give one of: rdf, sk, msd, profile, transport, pressure_tensor");
  EXPECT_EQ(
      error_of("rdf", *system, {{"range", 1e3}}).find("rdf: g(r) cannot be taken to 1000 in this box; take at most"),
      0u);
  EXPECT_NE(error_of("rdf", *system, {{"bins", 1'000'001}}).find("take at most 1000000"), std::string::npos);
  EXPECT_EQ(error_of("profile", *system, {{"axis", 2}}),
            "profile: there is no such axis; the axes are numbered from 0");
  EXPECT_EQ(error_of("profile", *system, {{"axis", 1}}), "");
}

const std::vector<double>& column(const std::vector<TableColumn>& table, std::string_view name) {
  for (const TableColumn& each : table)
    if (each.name == name) return each.values;
  ADD_FAILURE() << "no column " << name;
  return table[0].values;
}

TEST(Profile, ByHand) {
  const auto system = test::make_system<2>({8, 5}, Boundary::periodic, {{0, 0}, {1.9, 3}, {6.1, 2}, {7.99, 4}},
                                           {{1, 2}, {0, 3}, {-2, 0}, {1, 1}}, {}, {1, 2, 3, 4});
  const auto profile = make_observable("profile", *system, {{"interval", 1.0}, {"bins", 4}});
  profile->sample(0, system->particles);
  system->particles.x[1][0] = 2.1;
  profile->sample(1, system->particles);
  const auto table = profile->table();
  ASSERT_EQ(table.size(), 13u);
  EXPECT_EQ(table[0].name, "x");
  EXPECT_EQ(table[0].values, (std::vector<double>{1, 3, 5, 7}));
  for (const auto& [slab, found] : std::map<std::size_t, double>{{0, 3}, {1, 1}, {2, 0}, {3, 4}})
    EXPECT_DOUBLE_EQ(column(table, "density")[slab], found / 20) << slab;  // two samples of 2 × 5
  const std::vector<double>& temperature = column(table, "temperature");
  EXPECT_DOUBLE_EQ(temperature[0], (5 + 18 + 5) / (2 * 3.0));
  EXPECT_DOUBLE_EQ(temperature[1], 18 / 2.0);
  EXPECT_TRUE(std::isnan(temperature[2]));
  EXPECT_DOUBLE_EQ(temperature[3], 2 * (12 + 8) / (2 * 4.0));
  EXPECT_DOUBLE_EQ(column(table, "velocity_x")[0], 2 / 4.0);  // Σ m v over Σ m: masses 1, 2 and 1
  EXPECT_DOUBLE_EQ(column(table, "velocity_y")[0], (2 + 6 + 2) / 4.0);
  EXPECT_DOUBLE_EQ(column(table, "velocity_x")[3], (-6 + 4) / 7.0);

  const auto across = make_observable("profile", *system, {{"interval", 1.0}, {"bins", 5}, {"axis", 1}});
  across->sample(0, system->particles);
  EXPECT_EQ(across->table()[0].values, (std::vector<double>{0.5, 1.5, 2.5, 3.5, 4.5}));
  EXPECT_EQ(across->table()[1].values, (std::vector<double>{1 / 8.0, 0, 1 / 8.0, 1 / 8.0, 1 / 8.0}));

  system->species = {"A", "B"};
  system->particles.species = {0, 1, 1, 0};
  const auto each = make_observable("profile", *system, {{"interval", 1.0}, {"bins", 2}});
  for (const double time : {0.0, 1.0}) each->sample(time, system->particles);
  const auto of_species = each->table();
  ASSERT_EQ(of_species.size(), 25u);
  EXPECT_EQ(column(of_species, "density_A"), (std::vector<double>{1 / 20.0, 1 / 20.0}));
  EXPECT_EQ(column(of_species, "density_B"), (std::vector<double>{1 / 20.0, 1 / 20.0}));
  EXPECT_EQ(column(of_species, "temperature_A"), (std::vector<double>{5 / 2.0, 8 / 2.0}));
  EXPECT_EQ(column(of_species, "temperature_B"), (std::vector<double>{18 / 2.0, 12 / 2.0}));
  EXPECT_EQ(of_species[9].name, "error_density");
  EXPECT_EQ(of_species[24].name, "samples_temperature_B");
}

/// The upper wall of y moves from 5 to 3, a slab follows it; along x, which is open, a particle beyond the edge is in
/// no slab.
TEST(Profile, FollowsWallsThatMoveAndLeavesOutWhatIsBeyondAnOpenEdge) {
  const auto system = test::make_system<2>({8, 5}, Boundary::wall, {{1, 1}, {9, 1.6}}, {{0, 0}, {0, 0}});
  system->box.boundary[0] = Boundary::open;
  system->box.add({.name = "y-", .velocity = 0.25});
  system->box.add({.name = "y+", .velocity = 1});
  const auto up = make_observable("profile", *system, {{"interval", 1.0}, {"bins", 2}, {"axis", 1}});
  const auto along = make_observable("profile", *system, {{"interval", 1.0}, {"bins", 2}});
  for (const double time : {0.0, 2.0})
    for (const auto& profile : {up.get(), along.get()}) profile->sample(time, system->particles);
  // The faces are at 0 and 5 first, at 0.5 and 3 then. Both particles are in the lower slab each time.
  EXPECT_EQ(column(up->table(), "x"), (std::vector<double>{(1.25 + 1.125) / 2, (3.75 + 2.375) / 2}));
  EXPECT_EQ(column(up->table(), "density"), (std::vector<double>{4 / (8 * 2.5 + 8 * 1.25), 0}));
  EXPECT_EQ(column(along->table(), "density"), (std::vector<double>{2 / (4 * 5 + 4 * 2.5), 0}));
}

/// The mean over all slabs is the pressure tensor.
TEST(Profile, PressuresAddUpToThePressureTensor) {
  for (const bool forces : {false, true}) {
    auto system = test::hard_spheres<3>(4, 0.3);
    if (forces) add_interaction(*system, "yukawa", {{"amplitude", 2.0}, {"kappa", 1.0}, {"cutoff", 2.5}});
    auto run = test::make_run<3>(std::move(system), forces ? "edda" : "free-flight",
                                 {.step = forces ? 0.02 : 0.5, .end_time = forces ? 3.0 : 40.0});
    const double interval = forces ? 0.02 : 0.5;
    const auto tensor = make_observable("pressure_tensor", run->system(), {{"interval", interval}});
    const auto profile = make_observable("profile", run->system(),
                                         {{"interval", interval}, {"bins", 4}, {"axis", 2}, {"pressure", true}});
    run->add(*tensor);
    run->add(*profile);
    run->run();
    const auto all = tensor->table(), slabs = profile->table();
    const std::array<std::pair<const char*, std::size_t>, 4> components = {
        {{"pressure_xx", 0}, {"pressure_yy", 4}, {"pressure_zz", 8}, {"pressure_xz", 2}}};
    for (const auto& [name, place] : components) {
      double mean = 0;
      for (const double each : column(slabs, name)) mean += each / 4;
      const double symmetric = 0.5 * (column(all, "pressure")[place] + column(all, "pressure")[place == 2 ? 6 : place]);
      // Kinetic parts at samples here, their exact integral there: they differ in free flight.
      EXPECT_NEAR(mean, symmetric, forces ? 0.05 : 0.1) << name << (forces ? " with forces" : "");
    }
  }
}

/// Samples that do not depend on each other: the errors are those of numbers and temperatures that are drawn afresh. A
/// fixed disc counts in the density and has no temperature.
TEST(Profile, ErrorsAreThoseOfIndependentSamples) {
  constexpr int kMoving = 10, kSamples = 2000;
  auto system =
      test::make_system<2>({8, 5}, Boundary::periodic, std::vector<Vec<2>>(kMoving + 1, Vec<2>(1, 1)),
                           std::vector<Vec<2>>(kMoving + 1, Vec<2>::Zero()), {}, std::vector<double>(kMoving + 1, 2.0));
  system->particles.mass[kMoving] = std::numeric_limits<double>::infinity();
  const auto profile = make_observable("profile", *system, {{"interval", 1.0}, {"bins", 2}});
  RandomStream random(1, RandomPurpose::probe, 0);
  for (int n = 0; n < kSamples; ++n) {
    for (int i = 0; i < kMoving; ++i) {
      system->particles.x[i][0] = 8 * random.uniform();
      const auto pair = random.normal_pair();
      system->particles.v[i] = {pair[0], pair[1]};
    }
    profile->sample(n, system->particles);
  }
  const auto table = profile->table();
  const auto &density = column(table, "density"), &density_error = column(table, "error_density");
  const auto &temperature = column(table, "temperature"), &temperature_error = column(table, "error_temperature");
  for (const std::size_t bin : {0, 1}) {
    EXPECT_NEAR(density[bin], (bin == 0 ? 6.0 : 5.0) / 20, 5 * std::sqrt(2.5 / kSamples) / 20) << bin;
    EXPECT_NEAR(density_error[bin], std::sqrt(2.5 / kSamples) / 20, 0.3 * density_error[bin]) << bin;
    // m v² of a degree of freedom has the mean 2 and the variance 8; there are 2 · 5 of them in a bin on average.
    EXPECT_NEAR(temperature[bin], 2, 5 * std::sqrt(0.8 / kSamples)) << bin;
    EXPECT_NEAR(temperature_error[bin], std::sqrt(0.8 / kSamples), 0.3 * temperature_error[bin]) << bin;
  }
}

TEST(Profile, OfAUniformFluidIsFlat) {
  auto run = test::make_run<3>(test::hard_spheres<3>(4, 0.3), "free-flight", {.step = 0.5, .end_time = 60});
  const double n = 256, volume = run->system().box.volume();
  const auto profile = make_observable("profile", run->system(), {{"interval", 0.5}, {"bins", 8}, {"axis", 2}}, 5);
  run->add(*profile);
  run->run();
  const auto table = profile->table();
  const double counts = static_cast<double>(profile->samples()) * n / 8;
  EXPECT_GE(profile->samples(), 110u);
  for (std::size_t b = 0; b < 8; ++b) {
    // The scatter of an ideal gas in independent samples; these samples scatter about like a quarter as many.
    EXPECT_NEAR(column(table, "density")[b], n / volume, 5 * 2 * n / volume / std::sqrt(counts)) << b;
    EXPECT_NEAR(column(table, "temperature")[b], 1, 5 * 2 * std::sqrt(2 / (3 * counts))) << b;
  }
}

}  // namespace
}  // namespace carom::observable_test
