// SPDX-License-Identifier: BSD-3-Clause
// Baths and thermal walls: canonical kinetic energies, closed ledgers, the same bits after a pause.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/base/error.h"
#include "engine/events/thermal_contact.h"
#include "engine/laws/bath_options.h"
#include "engine/run/baths.h"
#include "tests/support/experiments.h"

namespace carom::bath_test {
namespace {

/// The sums over what an observer sees, and the standard error of the mean from blocks.
class Series {
 public:
  void add(double value) { values_.push_back(value); }
  double mean(std::size_t first, std::size_t last) const {
    double sum = 0;
    for (std::size_t k = first; k < last; ++k) sum += values_[k];
    return sum / static_cast<double>(last - first);
  }
  double mean() const { return mean(0, values_.size()); }
  double error(std::size_t blocks = 20) const {
    const std::size_t length = values_.size() / blocks;
    double squared = 0;
    for (std::size_t b = 0; b < blocks; ++b) squared += std::pow(mean(b * length, (b + 1) * length) - mean(), 2);
    return std::sqrt(squared / static_cast<double>(blocks * (blocks - 1)));
  }

 private:
  std::vector<double> values_;
};

/// Kinetic energies in units of their canonical mean, their squared deviations in units of the variance, and fourth
/// powers of velocities in units of their mean in the distribution of Maxwell and Boltzmann.
class Kinetic : public Observer<3> {
 public:
  Kinetic(double temperature, std::size_t spheres, double after)
      : freedoms_(3 * static_cast<double>(spheres)), expected_(0.5 * freedoms_ * temperature), after_(after) {}
  void thermo(const Snapshot<3>& shot) override {
    if (shot.time < after_) return;
    const double relative = shot.kinetic / expected_;
    mean.add(relative);
    variance.add((relative - 1) * (relative - 1) * freedoms_ / 2);
    double sum = 0;
    for (const Vec<3>& v : shot.particles->v) sum += v.array().pow(4).sum();
    const double thermal = 2 * expected_ / freedoms_;  // of spheres of mass 1
    fourth.add(sum / (3 * freedoms_ * thermal * thermal));
  }
  Series mean, variance, fourth;

 private:
  double freedoms_, expected_, after_;
};

std::unique_ptr<System<3>> fluid(int cells, bool charged) {
  auto system = test::hard_spheres<3>(cells, 0.25);
  if (charged)
    add_interaction(*system, "yukawa",
                    {{"amplitude", 5.0}, {"kappa", 2.0}, {"cutoff", 2.0}, {"cut", std::string("force-shifted")}});
  return system;
}

struct Case {
  Bath::Type type;
  std::string method;
};

class Canonical : public testing::TestWithParam<Case> {};

/// The kinetic energy has the mean and the variance of the canonical ensemble, velocities have the fourth moment of the
/// distribution of Maxwell and Boltzmann, and the ledger closes. The times between
/// rows are longer than the correlations; blocks give the standard errors.
TEST_P(Canonical, MeanAndVariance) {
  const auto& [type, method] = GetParam();
  constexpr double kTemperature = 1.5, kStart = 4, kEnd = 104;
  const bool flight = method == "free-flight";
  auto system = fluid(flight ? 5 : 4, !flight);
  const std::size_t n = system->size();
  system->box.bath = {
      .type = type, .temperature = kTemperature, .last_temperature = kTemperature, .friction = {4}, .rate = 4};
  auto run = test::make_run<3>(std::move(system), method,
                               {.step = flight ? 0.025 : 0.02, .end_time = kEnd, .thermo_interval = 0.1});
  Kinetic kinetic(kTemperature, n, kStart);
  run->add(kinetic);
  run->run();
  const Statistics& s = run->statistics();
  EXPECT_NEAR(kinetic.mean.mean(), 1, 4 * kinetic.mean.error());
  EXPECT_LT(kinetic.mean.error(), 0.006);
  const auto spheres = static_cast<double>(n);
  EXPECT_NEAR(kinetic.variance.mean(), 1, 4 * kinetic.variance.error());
  EXPECT_LT(kinetic.variance.error(), 0.15);
  EXPECT_NEAR(kinetic.fourth.mean(), 1, 4 * kinetic.fourth.error());
  EXPECT_LT(kinetic.fourth.error(), 0.015);
  EXPECT_LT(s.max_energy_error, (method == "psa" ? 1 : 1e-12) * s.energy_reference);
  EXPECT_NE(s.counters.heat.value(), 0);
  const double kicks = 4 * kEnd * spheres;
  if (type == Bath::Type::andersen) {
    EXPECT_NEAR(static_cast<double>(s.counters.kicks), kicks, 4 * std::sqrt(kicks));
  } else if (type == Bath::Type::rescaling) {
    EXPECT_LT(s.max_momentum_error.value(), 1e-10);
  }
}

INSTANTIATE_TEST_SUITE_P(All, Canonical,
                         testing::Values(Case{Bath::Type::rescaling, "free-flight"}, Case{Bath::Type::rescaling, "psa"},
                                         Case{Bath::Type::rescaling, "edda"}, Case{Bath::Type::andersen, "free-flight"},
                                         Case{Bath::Type::andersen, "psa"}, Case{Bath::Type::andersen, "edda"},
                                         Case{Bath::Type::langevin, "free-flight"}, Case{Bath::Type::langevin, "edda"}),
                         [](const auto& one) {
                           std::string name = one.param.method == "free-flight" ? "flight" : one.param.method;
                           return name.append(one.param.type == Bath::Type::andersen    ? "_andersen"
                                              : one.param.type == Bath::Type::rescaling ? "_rescaling"
                                                                                        : "_langevin");
                         });

/// All methods: the energy that the particles gain is the heat.
TEST(Baths, HeatIsTheEnergyGained) {
  for (const Bath::Type type : {Bath::Type::andersen, Bath::Type::rescaling, Bath::Type::langevin})
    for (const std::string method : {"free-flight", "psa", "cva", "mcva", "cdda", "edda", "verlet"}) {
      auto system = fluid(2, method != "free-flight");
      system->box.bath = {.type = type, .temperature = 2, .last_temperature = 3, .friction = {1}, .rate = 1};
      auto run = test::run_until<3>(std::move(system), method, 0.01, 0.5);
      const Statistics& s = run->statistics();
      EXPECT_NEAR(s.counters.heat.value(), s.energy_final - s.energy_initial, 0.05 * s.energy_reference) << method;
      EXPECT_GT(s.counters.heat.value(), 0.05 * s.energy_initial) << method;
      const bool exact = method == "free-flight" || method == "edda" || method == "cdda";
      EXPECT_LT(s.max_energy_error, (exact ? 1e-12 : 0.05) * s.energy_reference) << method;
    }
}

TEST(Baths, TheTemperatureOfARampIsLinear) {
  Bath bath{.type = Bath::Type::rescaling, .temperature = 1, .last_temperature = 3, .ramp_start = 2, .ramp_end = 6};
  EXPECT_EQ(bath.temperature_at(0), 1);
  EXPECT_EQ(bath.temperature_at(5), 2.5);
  EXPECT_EQ(bath.temperature_at(9), 3);
  auto system = fluid(2, true);
  system->box.bath = {.type = Bath::Type::rescaling, .temperature = 1, .last_temperature = 3, .rate = 50};
  const auto run = test::run_until<3>(std::move(system), "edda", 0.02, 5);
  EXPECT_EQ(run->system().box.bath.ramp_end, 5);
  double kinetic = 0;
  for (const Vec<3>& v : run->system().particles.v) kinetic += 0.5 * v.squaredNorm();
  EXPECT_NEAR(kinetic / (1.5 * 32), 3, 4 * 3 * std::sqrt(2.0 / (3 * 32)));
}

/// Kicks come at independent times at the given rate, wherever the search for them starts.
TEST(Baths, KicksArePoissonian) {
  const Bath bath{.type = Bath::Type::andersen, .rate = 2.5, .seed = 7};
  double sum = 0, squares = 0, t = 0;
  int kicks = 0;
  for (double next; (next = bath.next_kick(3, 0, t, 1e9)) < 4000; t = next, ++kicks) {
    ASSERT_GT(next, t);
    EXPECT_EQ(bath.next_kick(3, 0, 0.5 * (t + next), 1e9), next);
    sum += next - t;
    squares += (next - t) * (next - t);
  }
  EXPECT_NEAR(kicks, 10000, 4 * 100);
  EXPECT_NEAR(sum / kicks, 0.4, 4 * 0.4 / 100);
  EXPECT_NEAR(squares / kicks, 2 * 0.16, 4 * std::sqrt(20.0) * 0.16 / 100);  // of an exponential distribution
  EXPECT_NE(bath.next_kick(4, 0, 0, 1e9), bath.next_kick(3, 0, 0, 1e9));
  EXPECT_EQ(bath.next_kick(3, 100, 0, 1e9), bath.next_kick(3, 0, 100, 1e9) - 100);
}

/// The velocity after a kick has the temperature of the ramp at the time of the kick, wherever the slab begins.
TEST(Baths, AKickHasTheTemperatureOfItsTime) {
  const Bath ramp{
      .type = Bath::Type::andersen, .temperature = 1, .last_temperature = 9, .ramp_start = 2, .ramp_end = 6};
  const Bath constant{.type = Bath::Type::andersen, .temperature = 5, .last_temperature = 5};
  const Draw draw{.id = 5, .time = 4, .number = 1};
  EXPECT_EQ(kicked_velocity<3>(ramp, 0.5, draw), kicked_velocity<3>(constant, 0.5, draw));
}

/// A relaxation time far below the slab draws each kinetic energy afresh: its mean and variance are those of the four
/// degrees of freedom of two discs.
TEST(Baths, RescalingGivesTwoDiscsTheEnergyOfFourDegreesOfFreedom) {
  auto system = test::make_system<2>({8, 8}, Boundary::periodic, {{2, 2}, {5, 5}}, {{1, 0}, {-1, 0}});
  system->box.bath = {.type = Bath::Type::rescaling, .temperature = 3, .last_temperature = 3, .rate = 1000};
  constexpr int kSlabs = 20000;
  Counters counters;
  double sum = 0, squares = 0;
  for (int slab = 0; slab < kSlabs; ++slab) {
    rescale(*system, slab, slab + 1.0, 1.0, counters);
    double kinetic = 0;
    for (const Vec<2>& v : system->particles.v) kinetic += 0.5 * v.squaredNorm();
    sum += kinetic / kSlabs;
    squares += kinetic * kinetic / kSlabs;
  }
  EXPECT_NEAR(sum, 2 * 3, 4 * 3 * std::sqrt(2.0 / kSlabs));
  EXPECT_NEAR(squares - sum * sum, 2 * 9, 4 * 18 * std::sqrt(5.0 / kSlabs));  // of a gamma distribution of shape 2
}

/// The velocities behind a thermal wall that moves: flux-weighted along the normal, normal along the wall.
TEST(ThermalWalls, VelocitiesAreThoseOfAGasBehindTheWall) {
  constexpr int kDraws = 20000;
  constexpr double kTemperature = 2, kMass = 0.5, kSpeed = 0.3;
  Wall<3> wall{.normal = Vec<3>(0, 0.6, 0.8), .velocity = kSpeed, .temperature = kTemperature};
  const Vec<3> along(0, 0.8, -0.6);
  double normal = 0, normal_squared = 0, tangential = 0, tangential_squared = 0;
  for (int k = 0; k < kDraws; ++k) {
    const Vec<3> v =
        thermal_velocity(wall, kMass, {.id = 5, .time = 1.5, .number = static_cast<std::uint64_t>(k)}, 0.0);
    const double away = wall.opening(v);
    ASSERT_GT(away, 0);
    normal += away / kDraws;
    normal_squared += away * away / kDraws;
    tangential += v.dot(along) / kDraws;
    tangential_squared += v.dot(along) * v.dot(along) / kDraws;
  }
  const double variance = kTemperature / kMass, root = std::sqrt(kDraws);
  EXPECT_NEAR(normal, std::sqrt(std::numbers::pi / 2 * variance),
              4 * std::sqrt((2 - std::numbers::pi / 2) * variance) / root);
  EXPECT_NEAR(normal_squared, 2 * variance, 4 * 2 * variance / root);
  EXPECT_NEAR(tangential, 0, 4 * std::sqrt(variance) / root);
  EXPECT_NEAR(tangential_squared, variance, 4 * std::sqrt(2.0) * variance / root);
}

/// All methods: between two walls of different temperatures heat flows, and the ledger closes. Spheres fall on one.
TEST(ThermalWalls, HeatIsTheEnergyGained) {
  for (const std::string method : {"free-flight", "psa", "cva", "mcva", "cdda", "edda"}) {
    auto system = test::make_system<2>({8, 8}, Boundary::wall, {{2, 0.5}, {4, 3}, {6, 5}, {2, 6}, {6, 1}},
                                       {{0.3, 0}, {0.1, 0.5}, {-0.2, -0.4}, {0, 0}, {0.6, 0.2}});
    system->box.add({.name = "y-", .temperature = 4, .seed = 3});
    system->box.add({.name = "y+", .velocity = 0.05, .temperature = 1, .seed = 4});
    add_interaction(*system, "uniform-field", {{"acceleration", std::vector<double>{0, -0.5}}});
    if (method != "free-flight")
      add_interaction(*system, "harmonic-bond",
                      {{"pairs", PairList{{0, 1}, {2, 3}}}, {"stiffness", 0.5}, {"rest_length", 2.0}});
    const auto run = test::run_until<2>(std::move(system), method, 0.01, 30);
    const Statistics& s = run->statistics();
    ASSERT_GE(s.counters.walls.size(), 4u);
    const WallTally &hot = s.counters.walls[2], &cold = s.counters.walls[3];
    EXPECT_GT(hot.contacts, 20u) << method;
    EXPECT_GT(cold.contacts, 5u) << method;
    EXPECT_GT(hot.heat.value(), 0) << method;
    EXPECT_NE(cold.work.value(), 0) << method;
    EXPECT_NEAR(hot.heat.value() + cold.heat.value(), s.counters.heat.value(), 1e-9) << method;
    const bool exact = method == "free-flight" || method == "edda" || method == "cdda";
    EXPECT_LT(s.max_energy_error,
              (exact ? 1e-12 : 0.02) * std::max(s.energy_reference, std::abs(s.counters.heat.value())))
        << method;
  }
}

/// A gas between thermal walls and sides that reflect takes the temperature of the walls.
TEST(ThermalWalls, AGasTakesTheirTemperature) {
  auto system = test::hard_spheres<3>(3, 0.1);
  const double edge = system->box.edges[0];
  system->box.boundary[0] = Boundary::wall;
  for (Vec<3>& x : system->particles.x) x[0] = 0.5 + 1e-9 + x[0] * (1 - 1.0 / edge);
  system->box.edges[0] = edge + 1;
  system->box.add({.name = "x-", .temperature = 2.5, .seed = 8});
  system->box.add({.name = "x+", .temperature = 2.5, .seed = 9});
  const std::size_t n = system->size();
  auto run = test::make_run<3>(std::move(system), "free-flight", {.step = 1, .end_time = 1100, .thermo_interval = 1});
  Kinetic kinetic(2.5, n, 100);
  run->add(kinetic);
  run->run();
  EXPECT_NEAR(kinetic.mean.mean(), 1, 4 * kinetic.mean.error());
  EXPECT_LT(kinetic.mean.error(), 0.02);
  EXPECT_LT(run->statistics().max_energy_error, 1e-12 * run->statistics().energy_reference);
}

TEST(Baths, MistakesAreRefused) {
  const auto message = [](auto&& work) {
    try {
      work();
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  const auto given = [](const Parameters& p) { return bath_of(completed("bath", bath_parameters(), p)); };
  EXPECT_NE(message([&] {
              given({{"type", std::string("nose")}, {"temperature", 1.0}, {"rate", 1.0}});
            }).find("andersen"),
            std::string::npos);
  EXPECT_NE(message([&] {
              given({{"type", std::string("andersen")}, {"temperature", std::vector<double>{1, 2, 3}}, {"rate", 1.0}});
            }).find("3 numbers"),
            std::string::npos);
  EXPECT_NE(message([&] {
              given({{"type", std::string("andersen")}, {"temperature", std::vector<double>{1, -2}}, {"rate", 1.0}});
            }).find("positive"),
            std::string::npos);
  const auto start = [](const std::string& method, const Plan& plan, const Parameters& more, double last) {
    auto system = fluid(2, false);
    system->box.bath = {.type = Bath::Type::andersen, .temperature = 1, .last_temperature = last};
    test::make_run<3>(std::move(system), method, plan, more)->run();
  };
  EXPECT_NE(message([&] { start("free-flight", {.step = 1, .collisions = 10}, {}, 2); }).find("a ramp"),
            std::string::npos);
  EXPECT_NE(message([&] {
              start("mcva", {.step = 0.01, .steps = 3}, {{"variant", std::string("restart")}}, 1);
            }).find("knows no baths"),
            std::string::npos);
  const auto rate = [](const std::string& method, double each) {
    auto system = fluid(2, false);
    system->box.bath = {.type = Bath::Type::andersen, .rate = each};
    test::run_until<3>(std::move(system), method, 0.01, 0.02);
  };
  EXPECT_EQ(message([&] { rate("edda", 1e4); }), "");
  EXPECT_EQ(
      message([&] { rate("edda", 1e9); }),
      "the bath would kick each particle 1e+07 times in 0.01 units of time, and only the last kick matters; take a "
      "rate of at most 10000 (in step 1, from time 0)");
  EXPECT_EQ(
      message([&] { rate("free-flight", 1e300); }),
      "the bath would kick each particle 1e+298 times in 0.01 units of time; take a smaller rate (in step 1, from "
      "time 0)");
}

}  // namespace
}  // namespace carom::bath_test
