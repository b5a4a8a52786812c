// SPDX-License-Identifier: BSD-3-Clause
// Observables by their names: all declared ones, and the profile.

#include "engine/run/observable.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/base/error.h"
#include "engine/base/random.h"
#include "tests/support/experiments.h"

namespace carom {
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
  system->box.boundary[1] = Boundary::open;
  EXPECT_NE(error_of("profile", *system, {}).find("close the box"), std::string::npos);
}

TEST(Profile, ByHand) {
  const auto system = test::make_system<2>({8, 5}, Boundary::periodic, {{0, 0}, {1.9, 3}, {6.1, 2}, {7.99, 4}},
                                           {{1, 2}, {0, 3}, {-2, 0}, {1, 1}}, {}, {1, 2, 3, 4});
  const auto profile = make_observable("profile", *system, {{"interval", 1.0}, {"bins", 4}});
  profile->sample(0, system->particles);
  system->particles.x[1][0] = 2.1;
  profile->sample(1, system->particles);
  const auto table = profile->table();
  ASSERT_EQ(table.size(), 7u);
  EXPECT_EQ(table[0].name, "x");
  EXPECT_EQ(table[0].values, (std::vector<double>{1, 3, 5, 7}));
  EXPECT_EQ(table[1].name, "density");
  EXPECT_EQ(table[1].values, (std::vector<double>{3 / 20.0, 1 / 20.0, 0, 4 / 20.0}));  // two samples of 2 × 5
  EXPECT_EQ(table[2].name, "temperature");
  EXPECT_DOUBLE_EQ(table[2].values[0], (5 + 18 + 5) / (2 * 3.0));
  EXPECT_DOUBLE_EQ(table[2].values[1], 18 / 2.0);
  EXPECT_TRUE(std::isnan(table[2].values[2]));
  EXPECT_DOUBLE_EQ(table[2].values[3], 2 * (12 + 8) / (2 * 4.0));

  const auto across = make_observable("profile", *system, {{"interval", 1.0}, {"bins", 5}, {"axis", 1}});
  across->sample(0, system->particles);
  EXPECT_EQ(across->table()[0].values, (std::vector<double>{0.5, 1.5, 2.5, 3.5, 4.5}));
  EXPECT_EQ(across->table()[1].values, (std::vector<double>{1 / 8.0, 0, 1 / 8.0, 1 / 8.0, 1 / 8.0}));

  system->species = {"A", "B"};
  system->particles.species = {0, 1, 1, 0};
  const auto each = make_observable("profile", *system, {{"interval", 1.0}, {"bins", 2}});
  for (const double time : {0.0, 1.0}) each->sample(time, system->particles);
  const auto of_species = each->table();
  ASSERT_EQ(of_species.size(), 13u);
  EXPECT_EQ(of_species[3].name, "density_A");
  EXPECT_EQ(of_species[3].values, (std::vector<double>{1 / 20.0, 1 / 20.0}));
  EXPECT_EQ(of_species[4].name, "density_B");
  EXPECT_EQ(of_species[4].values, (std::vector<double>{1 / 20.0, 1 / 20.0}));
  EXPECT_EQ(of_species[9].name, "error_density_A");
  EXPECT_EQ(of_species[12].name, "samples_density_B");
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
  ASSERT_EQ(table[3].name, "error_density");
  ASSERT_EQ(table[5].name, "error_temperature");
  for (const std::size_t bin : {0, 1}) {
    EXPECT_NEAR(table[1].values[bin], (bin == 0 ? 6.0 : 5.0) / 20, 5 * std::sqrt(2.5 / kSamples) / 20) << bin;
    EXPECT_NEAR(table[3].values[bin], std::sqrt(2.5 / kSamples) / 20, 0.3 * table[3].values[bin]) << bin;
    // m v² of a degree of freedom has the mean 2 and the variance 8; there are 2 · 5 of them in a bin on average.
    EXPECT_NEAR(table[2].values[bin], 2, 5 * std::sqrt(0.8 / kSamples)) << bin;
    EXPECT_NEAR(table[5].values[bin], std::sqrt(0.8 / kSamples), 0.3 * table[5].values[bin]) << bin;
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
    EXPECT_NEAR(table[1].values[b], n / volume, 5 * 2 * n / volume / std::sqrt(counts)) << b;
    EXPECT_NEAR(table[2].values[b], 1, 5 * 2 * std::sqrt(2 / (3 * counts))) << b;
  }
}

}  // namespace
}  // namespace carom
