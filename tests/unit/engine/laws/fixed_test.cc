// SPDX-License-Identifier: BSD-3-Clause
// Fixed spheres, of infinite mass, and one-way walls.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "engine/base/error.h"
#include "engine/forces/add_interaction.h"
#include "tests/support/experiments.h"

namespace carom::fixed_test {
namespace {

const std::vector<std::string> kMethods = {"free-flight", "psa", "cva", "mcva", "cdda", "edda"};
constexpr double kFixed = std::numeric_limits<double>::infinity();

bool exact(const std::string& method) { return method == "free-flight" || method == "edda" || method == "cdda"; }

/// Discs in a box, of which some are fixed: three overlap each other and a wall.
std::unique_ptr<System<2>> pegs(Boundary boundary = Boundary::wall) {
  auto system =
      test::make_system<2>({12, 8}, boundary, {{3, 4}, {3.5, 4.2}, {0.2, 4}, {8, 4}, {6, 2}, {6, 6}, {10, 1.5}},
                           {{0, 0}, {0, 0}, {0, 0}, {0, 0}, {1, 0.3}, {-0.4, -0.9}, {0.2, 0.7}});
  for (const Id i : {0, 1, 2, 3}) system->particles.mass[i] = kFixed;
  return system;
}

TEST(Fixed, SpheresStayAndOthersBounceOffThem) {
  for (const std::string& method : kMethods)
    for (const Boundary boundary : {Boundary::wall, Boundary::periodic}) {
      SCOPED_TRACE(method);
      auto system = pegs(boundary);
      const std::vector<Vec<2>> before = system->particles.x;
      if (method != "free-flight")
        test::add_interaction(*system, "yukawa", {{"amplitude", 0.2}, {"kappa", 2.0}, {"cutoff", 3.0}});
      const auto run = test::run_until<2>(std::move(system), method, 0.01, 60);
      const auto& p = run->system().particles;
      const Statistics& s = run->statistics();
      for (const Id i : {0, 1, 2, 3}) {
        EXPECT_EQ(p.x[i], before[i]);
        EXPECT_EQ(p.v[i], (Vec<2>::Zero()));
      }
      EXPECT_GT(s.counters.sphere_sphere, 8u);
      EXPECT_LT(s.max_energy_error, (exact(method) ? 1e-12 : 5e-2) * s.energy_reference);
      EXPECT_GT(s.max_energy_error + 1, 1);  // not NaN
      EXPECT_FALSE(s.max_momentum_error);
      EXPECT_FALSE(s.mean_free_path);
      EXPECT_TRUE(std::isfinite(s.mean_pressure));
    }
}

/// A disc between two fixed ones: the path is known.
TEST(Fixed, ADiscBetweenTwoFixedOnes) {
  for (const std::string& method : kMethods) {
    auto system = test::make_system<2>({10, 4}, Boundary::wall, {{1, 2}, {9, 2}, {3, 2}}, {{0, 0}, {0, 0}, {1, 0}});
    system->particles.mass[0] = system->particles.mass[1] = kFixed;
    const auto run = test::run_until<2>(std::move(system), method, 0.1, 18);  // 5 to the right, 6 back, 6 and 1 more
    EXPECT_NEAR(run->system().particles.x[2][0], 7, 1e-13) << method;
    EXPECT_EQ(run->system().particles.v[2], (Vec<2>{-1, 0})) << method;
    EXPECT_EQ(run->statistics().counters.sphere_sphere, 3u) << method;
  }
}

/// A heavy sphere in place of a fixed one gives the same motion in the limit.
TEST(Fixed, IsTheLimitOfALargeMass) {
  for (const std::string& method : kMethods) {
    std::array<Vec<2>, 2> at{Vec<2>::Zero(), Vec<2>::Zero()};
    for (const bool fixed : {false, true}) {
      auto system = pegs();
      auto& p = system->particles;
      for (const Id i : {1, 2}) p.x[i] = {1.5, 1 + 6.0 * (i - 1)};
      if (!fixed)
        for (const Id i : {0, 1, 2, 3}) p.mass[i] = 1e13;
      at[fixed] = test::run_until<2>(std::move(system), method, 0.01, 10)->system().particles.x[5];
    }
    EXPECT_LT((at[0] - at[1]).norm(), 1e-8) << method;
  }
}

/// Only those that move have a temperature, and a bath gives them its own.
TEST(Fixed, HaveNoTemperature) {
  struct Last : Observer<2> {
    void thermo(const Snapshot<2>& shot) override {
      if (shot.time > 20) sum += shot.temperature, rows += 1;
    }
    double sum = 0;
    int rows = 0;
  };
  for (const Bath::Type type : {Bath::Type::none, Bath::Type::andersen, Bath::Type::rescaling})
    for (const std::string method : {"free-flight", "psa", "edda"}) {
      auto system = test::hard_spheres<2>(8, 0.3);
      auto& p = system->particles;
      double twice_kinetic = 0, moving = 0;
      for (Id i = 0; i < p.size(); ++i) {
        if (i % 2 == 0) p.mass[i] = kFixed, p.v[i].setZero();
        if (i % 2 == 1) twice_kinetic += p.v[i].squaredNorm(), moving += 1;
      }
      system->box.bath = {.type = type, .temperature = 3, .last_temperature = 3, .rate = 1, .seed = 5};
      Last last;
      auto run = test::make_run<2>(std::move(system), method, {.step = 0.05, .end_time = 100, .thermo_interval = 0.5});
      run->add(last);
      run->run();
      const double wanted = type == Bath::Type::none ? twice_kinetic / (2 * moving) : 3;
      EXPECT_NEAR(last.sum / last.rows, wanted, type == Bath::Type::none ? 1e-12 : 0.3) << method;
      const Statistics& s = run->statistics();
      EXPECT_LT(s.max_energy_error, 1e-11 * s.energy_reference) << method;
      for (Id i = 0; i < run->system().size(); i += 2) EXPECT_EQ(run->system().particles.v[i], (Vec<2>::Zero()));
    }
}

/// A disc lies still between fixed ones, and a pile on them comes to rest.
TEST(Fixed, CarryWhatRestsOnThem) {
  const double height = std::sqrt(1 - 0.36);
  for (const std::string method : {"psa", "cva", "cdda", "edda"}) {
    auto system =
        test::make_system<2>({10, 10}, Boundary::wall, {{4.4, 2}, {5.6, 2}, {5, 2 + height}}, {{0, 0}, {0, 0}, {0, 0}});
    system->particles.mass[0] = system->particles.mass[1] = kFixed;
    test::add_interaction(*system, "uniform-field", {{"acceleration", std::vector<double>{0, -1}}});
    const auto run = test::run_until<2>(std::move(system), method, 0.01, 2);
    EXPECT_NEAR(run->system().particles.x[2][1], 2 + height, method == "psa" ? 2e-3 : 1e-12) << method;
    EXPECT_NEAR(run->system().particles.x[2][0], 5, method == "psa" ? 2e-3 : 1e-6) << method;
  }
  for (const std::string method : {"psa", "edda"}) {
    const std::vector<Vec<2>> still(7, Vec<2>::Zero());
    auto system = test::make_system<2>({6, 10}, Boundary::wall,
                                       {{1, 0.5}, {2, 0.5}, {3, 0.5}, {4, 0.5}, {5, 0.5}, {2.6, 3}, {3.3, 4.5}}, still);
    auto& p = system->particles;
    for (Id i = 0; i < 5; ++i) p.mass[i] = kFixed;
    test::set_law(*system, {{"restitution", 0.5}, {"rest_speed", 0.01}});
    test::add_interaction(*system, "uniform-field", {{"acceleration", std::vector<double>{0, -1}}});
    const auto run = test::run_until<2>(std::move(system), method, 0.01, 60);
    EXPECT_LT(run->statistics().max_energy_error, method == "psa" ? 0.1 : 1e-9) << method;
    for (const Vec<2>& v : run->system().particles.v) EXPECT_LT(v.norm(), 0.03) << method;
  }
}

TEST(Fixed, WhatCannotBeIsRefused) {
  const auto message = [](auto&& work) -> std::string {
    try {
      work();
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  };
  const Plan plan{.step = 0.1, .end_time = 1};
  const auto run = [&](std::unique_ptr<System<2>> system, const char* method) {
    return message([&] { Simulation<2>(std::move(system), method, {}, plan).run(); });
  };
  auto moving = pegs();
  moving->particles.v[1] = {0, 1e-300};
  EXPECT_NE(run(std::move(moving), "psa").find("particle 1 is fixed"), std::string::npos);
  auto all = pegs();
  for (Id i = 0; i < all->size(); ++i) all->particles.mass[i] = kFixed, all->particles.v[i].setZero();
  EXPECT_NE(run(std::move(all), "psa").find("all particles are fixed"), std::string::npos);
  auto field = pegs();
  test::add_interaction(*field, "uniform-field", {{"acceleration", std::vector<double>{0, -1}}});
  EXPECT_NE(run(std::move(field), "free-flight").find("knows no fixed particles in a uniform-field"),
            std::string::npos);
  auto gravity = pegs();
  EXPECT_NE(message([&] {
              test::add_interaction(*gravity, "gravity", {{"constant", 1.0}});
            }).find("infinite mass"),
            std::string::npos);
  auto near = pegs();
  near->particles.x[4] = {3.2, 4.4};
  EXPECT_NE(run(std::move(near), "psa").find("overlap"), std::string::npos);
  EXPECT_EQ(run(pegs(), "psa"), "");
}

/// One disc comes from the front and is reflected, one comes from behind and passes, and is then kept in front.
TEST(OneWayWall, ReflectsFromOneSideOnly) {
  for (const std::string& method : kMethods) {
    auto system = test::make_system<2>({10, 4}, Boundary::wall, {{8, 1}, {2, 3}}, {{-1, 0}, {1, 0}});
    system->box.add({.name = "valve", .normal = {2, 0}, .offset = 10, .one_way = true});
    auto run = test::run_until<2>(std::move(system), method, 0.1, 4);
    EXPECT_NEAR(run->system().particles.x[0][0], 7, 1e-13) << method;  // touches 5.5 at time 2.5
    EXPECT_NEAR(run->system().particles.x[1][0], 6, 1e-13) << method;
    EXPECT_EQ(run->statistics().counters.sphere_wall, 1u) << method;
    run->extend({.end_time = 9});  // the second disc: at 9.5 at time 7.5
    run->run();
    EXPECT_NEAR(run->system().particles.x[1][0], 8, 1e-13) << method;
    run->extend({.end_time = 13});  // back at the valve at time 11.5
    run->run();
    EXPECT_NEAR(run->system().particles.x[1][0], 7, 1e-13) << method;
    EXPECT_EQ(run->system().particles.v[1], (Vec<2>{1, 0})) << method;
    EXPECT_LT(run->statistics().max_energy_error, 1e-13) << method;
  }
}

/// Under gravity a disc flies up through a one-way floor, falls on it and bounces; a slower one turns back on its way
/// through and leaves below.
TEST(OneWayWall, ADiscThatFliesThroughFallsOnIt) {
  for (const std::string& method : kMethods) {
    auto system = test::make_system<2>({10, 20}, Boundary::wall, {{2, 2}, {7, 2}}, {{0, 4}, {0, 2.6}});
    system->box.add({.name = "floor", .normal = {0, 1}, .offset = 5, .one_way = true});
    test::add_interaction(*system, "uniform-field", {{"acceleration", std::vector<double>{0, -1}}});
    // The first one rises to 10, and falls on the floor at 5.5 at time 4 + 3. The second one rises to 5.38.
    auto run = test::run_until<2>(std::move(system), method, 0.01, 8);
    const auto& p = run->system().particles;
    const double error = method == "psa" ? 0.02 : 1e-3;  // of first order
    EXPECT_NEAR(p.x[0][1], 5.5 + 3 - 0.5, error) << method;
    EXPECT_NEAR(p.v[0][1], 2, error) << method;
    const double fast = std::sqrt(2.6 * 2.6 + 3), t = 8 - 2.6 - fast;  // since it bounced off the floor of the box
    EXPECT_NEAR(p.x[1][1], 0.5 + fast * t - 0.5 * t * t, 2 * error) << method;
    EXPECT_EQ(run->statistics().counters.sphere_wall, 2u) << method;
  }
}

/// Spheres gather in front of a one-way wall, among many collisions; none comes back.
TEST(OneWayWall, CollectsAGas) {
  struct Valve : Observer<2> {
    Sampling sampling() const override { return {.interval = 0.25}; }
    void sample(double, const Particles<2>& p) override {
      passed.resize(p.size());
      front = 0;
      for (Id i = 0; i < p.size(); ++i) {
        const double clearance = wall.clearance(p.x[i], p.radius[i]);
        if (clearance > 1e-10) passed[i] = 1;
        EXPECT_TRUE(passed[i] == 0 || clearance > -1e-10) << i;
        front += passed[i];
      }
    }
    Wall<2> wall;
    std::vector<char> passed;
    int front = 0;
  };
  for (const std::string method : {"free-flight", "psa", "edda"}) {
    SCOPED_TRACE(method);
    auto system = test::hard_spheres<2>(6, 0.15);
    const int all = static_cast<int>(system->size());
    system->box.boundary.fill(Boundary::wall);
    for (Vec<2>& each : system->particles.x) each = 0.9 * each + 0.05 * system->box.edges;
    system->box.add({.name = "valve", .normal = {1, 0.2}, .offset = 0.6 * system->box.edges[0], .one_way = true});
    Valve valve;
    valve.wall = system->box.wall(4);
    auto run = test::make_run<2>(std::move(system), method, {.step = 0.05, .end_time = 150});
    run->add(valve);
    run->run();
    EXPECT_GT(valve.front, 0.8 * all);
    EXPECT_LT(run->statistics().max_energy_error, 1e-11 * run->statistics().energy_reference);
    EXPECT_LT(run->statistics().counters.max_overlap, 1e-11);
  }
}

TEST(OneWayWall, WhatCannotBeIsRefused) {
  const auto message = [](WallOptions<2> wall) -> std::string {
    Box<2> box{.edges = {4, 4}};
    try {
      box.add(std::move(wall));
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_EQ(message({.name = "w", .normal = {1, 0}, .offset = 2, .velocity = 0.1, .one_way = true}), "");
  EXPECT_EQ(message({.name = "w", .normal = {1, 0}, .one_sided = false, .one_way = true}),
            "the wall 'w' is one-way and has two sides; leave out one of one_way and one_sided");
  EXPECT_EQ(
      message({.name = "x-", .one_way = true}),
      "the wall 'x-' is a face of the box and cannot be one-way, because nothing is behind it; choose another name "
      "and give a normal");
  EXPECT_EQ(message({.name = "w", .normal = {1, 0}, .amplitude = 0.1, .frequency = 1, .one_way = true}),
            "the wall 'w' is one-way and shaken; give a constant velocity");
}

}  // namespace
}  // namespace carom::fixed_test
