// SPDX-License-Identifier: BSD-3-Clause
// Runs with steps of the pair energy: energies, exact motions, orders, tethers, and what is refused.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/base/error.h"
#include "engine/setup/step_options.h"
#include "tests/support/experiments.h"
#include "tests/support/static_scenes.h"

namespace carom::steps_run_test {
namespace {

template <int D>
void add(System<D>& system, Parameters given) {
  add_step<D>(system.box, system.species, system.size(), completed("step", step_parameters(), std::move(given)));
}

std::unique_ptr<System<3>> square_well(double packing_fraction, bool charged = false) {
  auto system = test::hard_spheres<3>(4, packing_fraction);
  add(*system, {{"between", std::vector<std::string>{"*", "*"}}, {"range", 1.5}, {"depth", 1.0}});
  if (charged)
    add_interaction(*system, "yukawa",
                    {{"amplitude", 5.0}, {"kappa", 2.0}, {"cutoff", 2.0}, {"cut", std::string("force-shifted")}});
  return system;
}

/// The energy is kept to rounding by the exact methods, and V is the number of pairs in the well.
TEST(Steps, TheLedgerOfASquareWellFluidCloses) {
  for (const std::string method : {"free-flight", "edda", "psa", "cdda"}) {
    const double end = method == "cdda" ? 1.0 : 2.0;  // cdda solves each collision
    const bool charged = method != "free-flight";
    auto system = square_well(0.2, charged);
    const std::size_t n = system->size();
    auto run = test::make_run<3>(std::move(system), method, {.step = 0.01, .end_time = end, .thermo_interval = 0.05});
    struct Energies : Observer<3> {
      void thermo(const Snapshot<3>& shot) override {
        EXPECT_EQ(shot.step_energy, -shot.bonds * static_cast<double>(shot.particles->size()));
        last = shot;
        if (first_bonds < 0) first_bonds = shot.bonds;
      }
      Snapshot<3> last;
      double first_bonds = -1;
    } energies;
    run->add(energies);
    run->run();
    const Statistics& s = run->statistics();
    const StepTally& steps = s.counters.steps;
    EXPECT_LT(s.max_energy_error, (method == "psa" ? 1e-2 : 1e-14) * s.energy_reference) << method;
    EXPECT_LT(*s.max_momentum_error, 1e-11) << method;
    EXPECT_GT(std::min({steps.entered, steps.left, steps.bounced, s.counters.sphere_sphere}),
              method == "cdda" ? 50U : 500U)
        << method;
    const double gained = static_cast<double>(steps.entered) - static_cast<double>(steps.left);
    EXPECT_NEAR((energies.last.bonds - energies.first_bonds) * static_cast<double>(n), gained, 1e-6) << method;
    EXPECT_EQ(steps.stored.value(), -gained) << method;
    EXPECT_LT(s.counters.max_overlap, 1e-11) << method;
  }
}

/// A pair that flies head-on into a well of depth ε, collides and leaves: each crossing changes the relative speed u to
/// √(u² ± 4ε) for spheres of mass 1.
TEST(Steps, APairPassesAWellAsTheFormulaSays) {
  constexpr double kDepth = 0.3, kSpeed = 0.5;  // of each sphere
  for (const std::string method : {"free-flight", "psa", "edda", "cdda"}) {
    auto system = test::make_system<2>({20, 20}, Boundary::open, {{8, 10}, {12, 10}}, {{kSpeed, 0}, {-kSpeed, 0}});
    add(*system, {{"between", std::vector<std::string>{"*", "*"}}, {"range", 2.0}, {"depth", kDepth}});
    const double inside = std::sqrt(4 * kSpeed * kSpeed + 4 * kDepth);
    const double there = 2 / (2 * kSpeed), within = 1 / inside, end = there + 2 * within + 1;
    const auto run = test::run_until<2>(std::move(system), method, 0.01, end);
    const auto& p = run->system().particles;
    EXPECT_NEAR(p.x[1][0] - p.x[0][0], 2 + 2 * kSpeed, 1e-12) << method;
    EXPECT_NEAR(p.v[0][0], -kSpeed, 1e-14) << method;
    const ContactTally& tally = run->statistics().counters;
    EXPECT_EQ(tally.steps.entered, 1U);
    EXPECT_EQ(tally.steps.left, 1U);
    EXPECT_EQ(tally.sphere_sphere, 1U);
  }
}

/// The orders of edda and cdda through crossings and bounces of a pair in a well, with a trap: both converge to the
/// same motion.
TEST(Steps, EddaAndCddaAreOfSecondOrder) {
  const auto end_of = [](const std::string& method, double h) {
    auto system = test::make_system<2>({20, 20}, Boundary::open, {{8.6, 10}, {11.5, 10.3}}, {{0.4, 0.1}, {-0.6, 0}});
    add(*system, {{"between", std::vector<std::string>{"*", "*"}},
                  {"range", std::vector<double>{1.3, 1.8}},
                  {"depth", std::vector<double>{-1.5, 0.15}}});
    add_interaction(*system, "harmonic-trap", {{"stiffness", 0.4}, {"centre", std::vector<double>{10, 10}}});
    const auto run = test::run_until<2>(std::move(system), method, h, 6.0);
    const Statistics& s = run->statistics();
    const StepTally& steps = s.counters.steps;
    EXPECT_GT(std::min(steps.entered + steps.left, steps.bounced), 1U) << method;
    EXPECT_LT(s.max_energy_error, 1e-13 * s.energy_reference) << method;
    return run->system().particles.x;
  };
  const auto exact = end_of("cdda", 1.0 / 2048);
  for (const std::string method : {"edda", "cdda"}) {
    std::vector<double> h, error;
    for (const double step : {1.0 / 16, 1.0 / 32, 1.0 / 64, 1.0 / 128}) {
      h.push_back(step);
      error.push_back(test::largest_difference(end_of(method, step), exact));
    }
    EXPECT_NEAR(test::fitted_order(h, error), 2, 0.2) << method;
  }
}

/// No bond leaves its limits, in frames of all methods.
TEST(Steps, BondsStayWithinTheirLimits) {
  for (const std::string method : {"free-flight", "psa", "edda", "cdda"}) {
    std::vector<Vec<3>> x, v;
    for (int i = 0; i < 10; ++i) {
      x.push_back({1.0 + i, 5, 5});
      v.push_back({std::sin(3.0 * i), std::cos(5.0 * i), std::sin(7.0 * i)});
    }
    auto system = test::make_system<3>({12, 12, 12}, Boundary::periodic, x, v, std::vector<double>(10, 0.45));
    add(*system, {{"chain", true}, {"tether", 1.1}, {"core", 0.95}});
    auto run = test::make_run<3>(std::move(system), method, {.step = 0.01, .end_time = 20, .frame_interval = 0.1});
    struct Lengths : Observer<3> {
      explicit Lengths(const Box<3>& of) : box(of) {}
      void frame(const Snapshot<3>& shot) override {
        for (Id i = 1; i < shot.particles->size(); ++i) {
          const Vec<3> d = shot.particles->x[i] - shot.particles->x[i - 1];
          const double length = (d + box.shift(box.nearest_image(d))).norm();
          shortest = std::min(shortest, length);
          longest = std::max(longest, length);
        }
      }
      const Box<3>& box;
      double shortest = 2, longest = 0;
    } lengths(run->system().box);
    run->add(lengths);
    run->run();
    EXPECT_GT(lengths.shortest, 0.95 - 1e-12) << method;
    EXPECT_LT(lengths.shortest, 0.952) << method;
    EXPECT_LT(lengths.longest, 1.1 + 1e-12) << method;
    EXPECT_GT(lengths.longest, 1.098) << method;
    EXPECT_GT(run->statistics().counters.steps.bounced, 300U) << method;
  }
}

/// A tether pulls a pair back by the law of its contacts, without friction.
TEST(Steps, TethersHaveTheRestitutionOfTheirPairs) {
  for (const std::string method : {"free-flight", "psa", "edda", "cdda"}) {
    auto system = test::make_system<2>({20, 20}, Boundary::open, {{8, 10}, {9.5, 10}}, {{-1, 0.2}, {1, 0}});
    test::set_law(*system, {{"restitution", 0.5}, {"tangential", -0.5}});
    system->particles.spin.assign(2, Spin<2>::Zero());
    add(*system, {{"pairs", PairList{{0, 1}}}, {"tether", 2.0}});
    const auto run = test::run_until<2>(std::move(system), method, 0.1, 0.5);
    const auto& p = run->system().particles;
    const Statistics& s = run->statistics();
    const Vec<2> d = p.x[1] - p.x[0], v = p.v[1] - p.v[0];
    EXPECT_EQ(s.counters.steps.bounced, 1U) << method;
    EXPECT_NEAR(s.counters.dissipated.value(), 0.75, 0.02) << method;
    EXPECT_NEAR(d.dot(v) / d.norm(), -1, 0.05) << method;
    EXPECT_NEAR(s.counters.collision_virial.value(), -3, 0.05) << method;
    EXPECT_EQ(p.spin[0], Spin<2>::Zero()) << method;
    EXPECT_LT(s.max_energy_error, 1e-14) << method;
  }
}

/// Wells keep the energy; where contacts lose it, pairs would come to rest at their ranges.
TEST(Steps, WellsHaveNoRestitution) {
  const auto run_with = [](const std::string& method) {
    auto system = test::make_system<2>({20, 20}, Boundary::open, {{8, 10}, {9.5, 10}}, {{-1, 0}, {1, 0}});
    test::set_law(*system, {{"restitution", 0.5}});
    add(*system, {{"between", std::vector<std::string>{"*", "*"}}, {"range", 2.0}, {"depth", 9.0}});
    return test::run_until<2>(std::move(system), method, 0.1, 0.5);
  };
  const auto run = run_with("free-flight");
  EXPECT_EQ(run->statistics().counters.dissipated.value(), 0);
  EXPECT_NEAR(run->system().particles.v[1][0], -1, 1e-15);
  EXPECT_NE(test::message_of([&] { run_with("edda"); }).find("come to rest at the ranges"), std::string::npos);
}

/// Disc 0 is fixed, and the others hang from it in a row, as the gaps say, under gravity.
std::unique_ptr<System<2>> chain(int discs, double spacing) {
  std::vector<Vec<2>> x;
  for (int k = 0; k <= discs; ++k) x.push_back({10, 40 - k * spacing});
  auto system = test::make_system<2>({20, 41}, Boundary::open, x, std::vector<Vec<2>>(x.size(), Vec<2>::Zero()));
  system->particles.mass[0] = std::numeric_limits<double>::infinity();
  add(*system, {{"chain", true}, {"tether", 1.2}});
  add_interaction(*system, "uniform-field", {{"acceleration", std::vector<double>{0, -1}}});
  return system;
}

/// A chain falls into its tethers, bounces and comes to rest with the tension of statics: the weight below.
TEST(Steps, AHangingChainComesToRest) {
  constexpr int kDiscs = 20;
  for (const std::string method : {"edda", "cdda", "psa"}) {
    auto system = chain(kDiscs, 1.15);
    test::set_law(*system, {{"restitution", 0.3}});
    const auto run = test::run_until<2>(std::move(system), method, 0.01, 20);
    const auto& p = run->system().particles;
    for (int k = 1; k <= kDiscs; ++k) EXPECT_NEAR(p.x[k][1], 40 - 1.2 * k, 1e-4) << method << ' ' << k;
    const auto tensions = test::reactions_of<2>(run->system());
    ASSERT_EQ(tensions.size(), std::size_t{kDiscs}) << method;
    for (const test::Reaction& each : tensions) EXPECT_NEAR(each.force, kDiscs + 1 - each.hi, 1e-10) << method;
    const Statistics& s = run->statistics();
    EXPECT_LT(s.max_energy_error, (method == "psa" ? 1e-2 : 1e-12) * s.energy_reference) << method;
    EXPECT_GT(s.counters.steps.bounced, 20U) << method;
  }
}

/// A taut chain hangs still, without a law of contacts too.
TEST(Steps, ATautChainStaysAtRest) {
  constexpr int kDiscs = 5;
  for (const std::string method : {"edda", "cdda"})
    for (const double step : {0.1, 0.001}) {
      const auto run = test::run_until<2>(chain(kDiscs, 1.2), method, step, 1);
      for (int k = 1; k <= kDiscs; ++k) EXPECT_NEAR(run->system().particles.x[k][1], 40 - 1.2 * k, 1e-12) << method;
      for (const test::Reaction& each : test::reactions_of<2>(run->system()))
        EXPECT_NEAR(each.force, kDiscs + 1 - each.hi, 1e-10) << method;
      EXPECT_EQ(run->statistics().counters.contacts(), 0U) << method;
    }
}

/// A disc that flies up bounces on the shoulder of a weight on a taut tether, and the weight flies on in its place.
TEST(Steps, AShoulderThrowsAWeightOffItsTautTether) {
  for (const std::string method : {"edda", "cdda"}) {
    auto system =
        test::make_system<2>({20, 41}, Boundary::open, {{10, 40}, {10, 38.8}, {10, 37}}, {{0, 0}, {0, 0}, {0, 1}});
    system->particles.mass[0] = std::numeric_limits<double>::infinity();
    add(*system, {{"pairs", PairList{{0, 1}}}, {"tether", 1.2}});
    add(*system, {{"pairs", PairList{{1, 2}}}, {"range", 1.5}, {"depth", -9.0}});
    add_interaction(*system, "uniform-field", {{"acceleration", std::vector<double>{0, -1}}});
    const auto run = test::run_until<2>(std::move(system), method, 0.01, 0.7);
    const double speed = std::sqrt(1 - 2 * 0.3), after = 0.7 - (1 - speed);  // from 37 to 38.8 − 1.5
    EXPECT_NEAR(run->system().particles.x[1][1], 38.8 + after * (speed - 0.5 * after), 1e-11) << method;
    EXPECT_NEAR(run->system().particles.x[2][1], 37.3 - 0.5 * after * after, 1e-11) << method;
    EXPECT_LT(run->statistics().max_energy_error, 1e-13 * run->statistics().energy_reference) << method;
  }
}

/// The bounces of a pair that turns on an inelastic tether end: then it turns on a circle with its angular momentum.
TEST(Steps, AnInelasticTetherEndsInACircle) {
  for (const std::string method : {"edda", "cdda", "psa"}) {
    auto system = test::make_system<2>({20, 20}, Boundary::open, {{9.25, 10}, {10.75, 10}}, {{-1, 0.4}, {1, -0.4}});
    test::set_law(*system, {{"restitution", 0.5}});
    add(*system, {{"pairs", PairList{{0, 1}}}, {"tether", 2.0}});
    const auto run = test::run_until<2>(std::move(system), method, 0.01, 40);
    const auto& p = run->system().particles;
    const Statistics& s = run->statistics();
    const Vec<2> d = p.x[1] - p.x[0], v = p.v[1] - p.v[0];
    const bool straight = method == "psa";  // it moves on the sides of a polygon
    EXPECT_NEAR(d.norm(), 2, straight ? 1e-5 : 1e-6) << method;
    EXPECT_NEAR(d.dot(v), 0, straight ? 1e-2 : 1e-6) << method;
    EXPECT_NEAR(d[0] * v[1] - d[1] * v[0], -1.2, 1e-6) << method;
    EXPECT_LT(s.max_energy_error, 1e-12) << method;
    EXPECT_GT(s.counters.steps.bounced, 5U) << method;
  }
}

/// A taut pair turns on a circle without a law, too: its tiny bounces would never end.
TEST(Steps, ATautPairTurnsOnACircle) {
  for (const std::string method : {"edda", "cdda"}) {
    auto system = test::make_system<2>({20, 20}, Boundary::open, {{9, 10}, {11, 10}}, {{-1e-9, 0.5}, {1e-9, -0.5}});
    add(*system, {{"pairs", PairList{{0, 1}}}, {"tether", 2.0}});
    const auto run = test::run_until<2>(std::move(system), method, 0.01, 10);
    const auto& p = run->system().particles;
    EXPECT_NEAR((p.x[1] - p.x[0]).norm(), 2, 1e-11) << method;
    EXPECT_NEAR(std::atan2(p.x[1][1] - p.x[0][1], p.x[1][0] - p.x[0][0]), 2 * std::numbers::pi - 5, 1e-3) << method;
    EXPECT_LT(run->statistics().counters.contacts(), 3U) << method;
  }
}

/// A weight on a taut tether swings on a circle: θ″ = −(g/L) sin θ.
TEST(Steps, APendulumSwingsOnItsTether) {
  constexpr double kLength = 1.2, kEnd = 3;
  double angle = 0.8, rate = 0;
  constexpr int kParts = 30000;
  for (int k = 0; k < kParts; ++k) {  // of second order, with an error of 1e-8
    const double h = kEnd / kParts;
    rate -= 0.5 * h / kLength * std::sin(angle);
    angle += h * rate;
    rate -= 0.5 * h / kLength * std::sin(angle);
  }
  for (const std::string method : {"edda", "cdda"}) {
    std::vector<double> h, error;
    for (const double step : {0.04, 0.02, 0.01}) {
      auto system = chain(1, kLength);
      system->particles.x[1] = system->particles.x[0] + kLength * Vec<2>(std::sin(0.8), -std::cos(0.8));
      const auto run = test::run_until<2>(std::move(system), method, step, kEnd);
      const auto& p = run->system().particles;
      const Statistics& s = run->statistics();
      const Vec<2> d = p.x[1] - p.x[0];
      EXPECT_NEAR(d.norm(), kLength, 1e-12) << method;
      EXPECT_LT(s.max_energy_error, 1e-13 * s.energy_reference) << method;
      EXPECT_EQ(s.counters.contacts(), 0U) << method;
      h.push_back(step);
      error.push_back(std::abs(std::atan2(d[0], -d[1]) - angle));
    }
    EXPECT_NEAR(test::fitted_order(h, error), 2, 0.2) << method;
  }
}

/// Places of events in long epochs are rounded by more than positions are, and pairs keep their sides.
TEST(Steps, ADiluteGasKeepsItsSidesInLongEpochs) {
  auto system = test::hard_spheres<3>(5, 5e-4);
  add(*system, {{"between", std::vector<std::string>{"*", "*"}}, {"range", 1.5}, {"depth", 1.0}});
  const auto run = test::run_until<3>(std::move(system), "free-flight", 320, 3200);
  EXPECT_LT(run->statistics().max_energy_error, 1e-13 * run->statistics().energy_reference);
  EXPECT_GT(run->statistics().counters.steps.events(), 3000U);
}

/// The range of a bond with a core of its own counts from the sum of the radii, in all methods.
TEST(Steps, RangesOfBondsDoNotDependOnTheirCores) {
  for (const std::string method : {"free-flight", "psa", "edda", "cdda"}) {
    auto system = test::make_system<2>({20, 20}, Boundary::open, {{9, 10}, {10.2, 10}}, {{-0.5, 0}, {0.5, 0}});
    add(*system, {{"pairs", PairList{{0, 1}}}, {"range", 1.5}, {"depth", 0.2}, {"core", 0.5}});
    const auto run = test::run_until<2>(std::move(system), method, 0.1, 1);
    EXPECT_EQ(run->statistics().counters.steps.left, 1U) << method;
    EXPECT_NEAR(run->system().particles.v[1][0], std::sqrt(0.25 - 0.2), 1e-15) << method;
  }
}

TEST(Steps, WhatCannotBeIsRefused) {
  const std::vector<std::string> all = {"*", "*"};
  const auto given = [](Parameters parameters) {
    return test::message_of([&] {
      auto system = square_well(0.2);
      system->box.steps = {};
      add(*system, parameters);
      Simulation<3>(std::move(system), "free-flight", {{"step", 0.1}}, {.end_time = 1}).run();
    });
  };
  for (const auto& [parameters, words] : std::vector<std::pair<Parameters, std::string>>{
           {{{"range", 1.5}, {"depth", 1.0}}, "names no pairs"},
           {{{"between", all}, {"range", 0.9}, {"depth", 1.0}}, "not above the contact distance"},
           {{{"between", all}, {"range", 0.9}, {"depth", 1.0}, {"unit", std::string("length")}},
            "not above their contact"},
           {{{"between", all}, {"range", std::vector<double>{1.5, 1.2}}, {"depth", std::vector<double>{1, 2}}},
            "not above the range 1.5"},
           {{{"between", all}, {"range", 1.5}}, "give a depth for each range"},
           {{{"between", all}, {"range", 1.5}, {"depth", 0.0}}, "does not jump"},
           {{{"between", all}, {"tether", 2.0}}, "joins listed pairs"},
           {{{"between", all}}, "neither 'range' nor"},
           {{{"between", std::vector<std::string>{"*", "b"}}, {"range", 1.5}, {"depth", 1.0}}, "'b' is no species"},
           {{{"pairs", PairList{{0, 1}}}, {"tether", 0.5}, {"core", 0.6}}, "not above the core"},
           {{{"pairs", PairList{{0, 1}}}, {"tether", 0.9}}, "their contact distance"},
           {{{"pairs", PairList{{0, 200}}}, {"tether", 1.2}}, "start at a distance of"},
           {{{"pairs", PairList{{0, 1000}}}, {"tether", 1.2}}, "names particle 1000"},
           {{{"between", all}, {"range", 9.0}, {"depth", 1.0}}, "enlarge the box"}})
    EXPECT_NE(given(parameters).find(words), std::string::npos) << words << ": " << given(parameters);
  EXPECT_NE(test::message_of([] {
              test::make_run<3>(square_well(0.2), "cva", {.step = 0.01, .end_time = 0.1})->run();
            }).find("take one of: "),
            std::string::npos);
}

/// A Langevin bath moves free spheres as the chain v → c v + noise: the mean squared displacement after n epochs of
/// length h is, for each axis, h² kT/m [n (1 + c)/(1 − c) − 2 c (1 − cⁿ)/(1 − c)²].
TEST(Langevin, FreeSpheresDiffuse) {
  constexpr double kFriction = 2, kStep = 0.1, kTemperature = 1;
  constexpr int kEpochs = 100;
  auto system = test::hard_spheres<3>(8, 1e-7);
  const std::vector<Vec<3>> start = system->particles.x;
  const double edge = system->box.edges[0];
  system->box.bath = {.type = Bath::Type::langevin,
                      .temperature = kTemperature,
                      .last_temperature = kTemperature,
                      .friction = {kFriction}};
  const auto run = test::run_steps<3>(std::move(system), "free-flight", kStep, kEpochs);
  const auto& p = run->system().particles;
  double squared = 0;
  for (Id i = 0; i < p.size(); ++i)
    for (int k = 0; k < 3; ++k) squared += std::pow(p.x[i][k] + p.image[i][k] * edge - start[i][k], 2);
  const double freedoms = 3 * static_cast<double>(p.size()), c = std::exp(-kFriction * kStep);
  const double expected = kStep * kStep * kTemperature *
                          (kEpochs * (1 + c) / (1 - c) - 2 * c * (1 - std::pow(c, kEpochs)) / ((1 - c) * (1 - c)));
  EXPECT_NEAR(squared / freedoms, expected, 4 * expected * std::sqrt(2 / freedoms));
}

/// Each species has its own friction: a mean velocity decays as exp(−γ t).
TEST(Langevin, EachSpeciesHasItsFriction) {
  auto system = test::make_system<2>({9, 9}, Boundary::periodic, {{2, 2}, {7, 7}}, {{1000, 0}, {0, 1000}});
  system->species = {"slow", "fast"};
  system->particles.species = {0, 1};
  system->box.bath = {.type = Bath::Type::langevin, .temperature = 1e-9, .last_temperature = 1e-9, .friction = {1, 3}};
  const auto run = test::run_steps<2>(std::move(system), "verlet", 0.25, 4);
  EXPECT_NEAR(run->system().particles.v[0][0], 1000 * std::exp(-1.0), 1e-3);
  EXPECT_NEAR(run->system().particles.v[1][1], 1000 * std::exp(-3.0), 1e-3);
}

/// Positions far outside an open box are rounded more; a pair that crosses a well there is not lost.
TEST(Steps, AreFoundFarFromTheBox) {
  for (const std::string method : {"free-flight", "psa", "edda", "cdda"})
    for (const double far : {0.1, 10.1, 1000.1, 10000.1}) {
      auto system = test::make_system<3>({1, 1, 1}, Boundary::open, {{far, 0, 0}, {far + 2.03, 0.3, 0}},
                                         {{0.37, 0, 0}, {-0.41, 0, 0}}, {0.5, 0.5});
      add(*system, {{"between", std::vector<std::string>{"*", "*"}}, {"range", 1.5}, {"depth", 1.0}});
      const auto run = test::run_until<3>(std::move(system), method, 0.05, 10);
      EXPECT_EQ(run->statistics().counters.steps.entered, 1u) << method << far;
      EXPECT_EQ(run->statistics().counters.steps.left, 1u) << method << far;
    }
}

}  // namespace
}  // namespace carom::steps_run_test
