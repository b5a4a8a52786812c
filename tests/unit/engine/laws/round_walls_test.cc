// SPDX-License-Identifier: BSD-3-Clause
// Spheres and cylinders as walls, from the inside and from the outside.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "engine/laws/wall_options.h"
#include "tests/support/experiments.h"
#include "tests/unit/engine/laws/contact_collector.h"

namespace carom::round_walls_test {
namespace {

using std::numbers::pi;

const std::vector<std::string> kMethods = {"free-flight", "psa", "cva", "mcva", "cdda", "edda"};
bool is_exact(const std::string& method) { return method == "free-flight" || method == "edda" || method == "cdda"; }

template <int D>
void add(System<D>& system, Parameters given) {
  add_wall<D>(system.box, completed("wall", wall_parameters(), std::move(given)));
}

template <int D>
std::unique_ptr<System<D>> in_cavity(std::vector<Vec<D>> x, std::vector<Vec<D>> v, const Parameters& more = {}) {
  auto system = test::make_system<D>(Vec<D>::Constant(10), Boundary::open, std::move(x), std::move(v));
  Parameters all{{"name", std::string("cavity")},
                 {"shape", std::string("sphere")},
                 {"centre", std::vector<double>(D, 5.0)},
                 {"radius", 4.0}};
  for (const auto& [key, value] : more.all()) all.set(key, value);
  add(*system, all);
  return system;
}

/// A disc that flies in a circle of radius ρ = R − r makes the chords of a regular polygon.
TEST(RoundWalls, ADiscInACircleFliesAlongChords) {
  constexpr double kReach = 3.5, kAngle = 0.3, kSpeed = 1.25;  // of the velocity against the tangent
  const int bounces = 1000;
  for (const std::string& method : kMethods) {
    const double chord = 2 * kReach * std::sin(kAngle) / kSpeed;
    auto system = in_cavity<2>({{5 + kReach * std::cos(kAngle), 5}}, {{0, kSpeed}});  // in the middle of a chord
    const int after = method == "free-flight" ? bounces : 20;
    const auto run = test::run_until<2>(std::move(system), method, method == "free-flight" ? 1000 : 0.1, after * chord);
    const Vec<2> x = run->system().particles.x[0] - Vec<2>(5, 5), v = run->system().particles.v[0];
    const double turned = 2 * kAngle * after;
    const double rounding = after * 1e-13;
    EXPECT_NEAR(x[0], kReach * std::cos(kAngle) * std::cos(turned), rounding) << method;
    EXPECT_NEAR(x[1], kReach * std::cos(kAngle) * std::sin(turned), rounding) << method;
    EXPECT_NEAR(x[0] * v[1] - x[1] * v[0], kReach * std::cos(kAngle) * kSpeed, rounding) << method;
    EXPECT_EQ(run->statistics().counters.sphere_wall, static_cast<std::uint64_t>(after)) << method;
    EXPECT_LT(run->statistics().max_energy_error, 1e-14) << method;
  }
}

/// Discs meet each other, the wall around them and a post in the middle, under gravity.
TEST(RoundWalls, KeepTheEnergyUnderGravity) {
  for (const std::string& method : kMethods) {
    auto system = in_cavity<2>({{5, 7.6}, {3.4, 4.1}, {7.2, 5.2}}, {{0.3, 0}, {0, 0.4}, {-0.2, 0}});
    add(*system, {{"name", std::string("post")},
                  {"shape", std::string("sphere")},
                  {"centre", std::vector{5.0, 5.0}},
                  {"radius", 0.5},
                  {"inside", false}});
    add_interaction(*system, "uniform-field", {{"acceleration", std::vector<double>{0, -1}}});
    auto run = test::make_run<2>(std::move(system), method, {.step = 0.01, .end_time = 20, .events = true});
    test::ContactCollector log;
    run->add(log);
    run->run();
    std::array<int, 6> hits{};
    for (const auto& contact : log.all) {
      if (contact.key.kind != EventKind::wall) continue;
      ++hits[contact.key.hi];
      const Vec<2> normal = contact.x_lo - contact.x_hi;
      EXPECT_NEAR(normal.norm(), 0.5, 1e-9) << method;
      EXPECT_NEAR((contact.x_hi - Vec<2>(5, 5)).norm(), contact.key.hi == 4 ? 4 : 0.5, 1e-12) << method;
      EXPECT_NEAR(normal.dot(contact.impulse), 0.5 * contact.impulse.norm(), 1e-9) << method;
    }
    EXPECT_GT(hits[4], 15) << method;
    EXPECT_GT(hits[5], 0) << method;
    const Statistics& s = run->statistics();
    EXPECT_LT(s.max_energy_error, (is_exact(method) ? 1e-12 : 1e-1) * s.energy_reference) << method;
    EXPECT_LT(s.counters.max_overlap, 1e-11) << method;
  }
}

/// The position after some bounces is that of free flight.
TEST(RoundWalls, MethodsAgreeWithFreeFlightUnderGravity) {
  const auto end = [](const std::string& method) {
    auto system = in_cavity<3>({{5, 6, 5.5}}, {{0.3, 0, 0.4}});
    add(*system, {{"name", std::string("post")},
                  {"shape", std::string("cylinder")},
                  {"centre", std::vector{5.0, 5.0, 5.0}},
                  {"axis", std::vector{1.0, 0.0, 2.0}},
                  {"radius", 0.25},
                  {"inside", false}});
    add_interaction(*system, "uniform-field", {{"acceleration", std::vector<double>{0, -1, 0}}});
    const auto run = test::run_until<3>(std::move(system), method, 0.05, 12);
    EXPECT_GT(run->statistics().counters.sphere_wall, 5u);
    return run->system().particles.x[0];
  };
  const Vec<3> exact = end("free-flight");
  for (const std::string method : {"psa", "cva", "cdda", "edda"})
    EXPECT_LT((end(method) - exact).norm(), method == "psa" ? 1.0 : 1e-8) << method;
}

/// Each sphere of an ideal gas of speed v presses on a spherical wall with m v²/(R − r), whatever its path, and on a
/// cylinder with m v²/(R − r) of the velocity across the axis: p V = N k T. Smooth walls keep the angular momentum
/// about their centre or axis.
TEST(RoundWalls, FeelThePressureOfAnIdealGas) {
  for (const bool cylinder : {false, true}) {
    std::vector<Vec<3>> x, v;
    for (int i = 0; i < 50; ++i) {
      const double t = 0.1 + i;
      x.push_back({5 + 1.9 * std::sin(3 * t), 5 + 1.9 * std::sin(5 * t), 5 + 1.9 * std::sin(7 * t)});
      v.push_back({std::cos(11 * t), std::cos(13 * t), std::cos(17 * t)});
    }
    auto system = test::make_system<3>({10, 10, 10}, Boundary::open, x, v, std::vector<double>(50, 1e-4));
    if (cylinder) system->box.boundary[2] = Boundary::periodic;
    Parameters wall{{"name", std::string("cavity")},
                    {"shape", std::string(cylinder ? "cylinder" : "sphere")},
                    {"centre", std::vector{5.0, 5.0, 5.0}},
                    {"radius", 4.0}};
    if (cylinder) wall.set("axis", std::vector{0.0, 0.0, 3.0});
    add(*system, wall);
    const auto angular_momentum = [&](const Particles<3>& p) {
      Vec<3> sum = Vec<3>::Zero();
      for (std::size_t i = 0; i < p.size(); ++i) sum += (p.x[i] - Vec<3>(5, 5, 5)).cross(p.v[i]);
      return sum;
    };
    double expected = 0;
    for (const Vec<3>& each : v) expected += (each.squaredNorm() - (cylinder ? each[2] * each[2] : 0)) / (4 - 1e-4);
    const Vec<3> before = angular_momentum(system->particles);
    const double end = 4000, area = system->box.area(system->box.wall(6), 0);
    EXPECT_NEAR(area, cylinder ? 2 * pi * 4 * 10 : 4 * pi * 16, 1e-12);
    const auto run = test::run_until<3>(std::move(system), "free-flight", 10, end);
    const auto& counters = run->statistics().counters;
    EXPECT_NEAR(counters.walls[6].impulse.value() / end, expected, 2e-3 * expected);  // a bounce more or less for each
    EXPECT_LT(run->statistics().max_energy_error, 1e-12 * run->statistics().energy_reference);
    const Vec<3> after = angular_momentum(run->system().particles);
    EXPECT_LT(cylinder ? std::abs(after[2] - before[2]) : (after - before).norm(), 1e-9);
  }
}

/// A disc that slides in a circle without friction is a pendulum of the length R − r: its period is 4 √(ℓ/g)
/// K(sin(θ/2)).
TEST(RoundWalls, ADiscThatSlidesIsAPendulum) {
  constexpr double kAngle = 1.0, kLength = 3.5;
  const double period = 4 * std::sqrt(kLength) * std::comp_ellint_1(std::sin(kAngle / 2));
  for (const std::string method : {"edda", "cdda", "psa", "cva", "mcva"})
    for (const double step : {period / 400, period / 800}) {
      const Vec<2> start(5 + kLength * std::sin(kAngle), 5 - kLength * std::cos(kAngle));
      auto system = in_cavity<2>({start}, {{0, 0}});
      add_interaction(*system, "uniform-field", {{"acceleration", std::vector<double>{0, -1}}});
      const auto run = test::run_until<2>(std::move(system), method, step, 2 * period);
      const auto& p = run->system().particles;
      const bool exact = is_exact(method);
      EXPECT_LT((p.x[0] - start).norm(), exact ? 20 * step * step : 4 * step) << method;
      EXPECT_NEAR((p.x[0] - Vec<2>(5, 5)).norm(), kLength, exact ? 1e-9 : 1e-2) << method;
      EXPECT_LT(run->statistics().max_energy_error, (exact ? 1e-12 : step) * run->statistics().energy_reference)
          << method;
    }
}

/// Discs that lose energy come to rest in a bowl, beside each other, and the ledger closes.
TEST(RoundWalls, DiscsComeToRestInABowl) {
  for (const std::string method : {"edda", "cdda", "psa"}) {
    auto system = in_cavity<2>({{4, 3}, {6, 4}}, {{0.2, 0}, {0, 0}});
    test::set_law(*system, {{"restitution", 0.5}});
    add_interaction(*system, "uniform-field", {{"acceleration", std::vector<double>{0, -1}}});
    const auto run = test::run_until<2>(std::move(system), method, 0.01, 60);
    const auto& p = run->system().particles;
    for (const Vec<2>& each : p.x) EXPECT_NEAR((each - Vec<2>(5, 5)).norm(), 3.5, 1e-4) << method;
    EXPECT_NEAR((p.x[0] - p.x[1]).norm(), 1, 1e-4) << method;
    const Statistics& s = run->statistics();
    EXPECT_GT(s.counters.dissipated.value(), 1) << method;
    EXPECT_LT(s.max_energy_error, (is_exact(method) ? 1e-11 : 1e-1) * s.energy_reference) << method;
  }
}

/// Rough, inelastic and heated walls: what spheres lose and get is in the ledger.
TEST(RoundWalls, HaveTheLawsOfPlanes) {
  for (const bool heated : {false, true}) {
    std::vector<Vec<3>> x, v;
    for (int i = 0; i < 27; ++i) {
      x.push_back({3.5 + 1.5 * (i % 3), 3.5 + 1.5 * (i / 3 % 3), 3.5 + 1.5 * (i / 9)});
      v.push_back({std::cos(11 * i), std::cos(13 * i), std::cos(17 * i)});
    }
    auto system = in_cavity<3>(x, v, heated ? Parameters{{"temperature", 2.0}} : Parameters{});
    if (!heated)
      test::set_law(*system,
                    {{"between", std::vector<std::string>{"*", "cavity"}}, {"restitution", 0.9}, {"tangential", 0.2}});
    const auto run = test::run_until<3>(std::move(system), "free-flight", 10, 100);
    const Statistics& s = run->statistics();
    EXPECT_GT(s.counters.sphere_wall, 250u);
    EXPECT_LT(s.max_energy_error, 1e-12 * s.energy_reference);
    EXPECT_GT(heated ? s.counters.heat.value() : s.counters.dissipated.value(), heated ? 10 : 1);
  }
}

TEST(RoundWalls, TakeAnAxisOfAnyLength) {
  for (const double length : {1e200, 1.0, 1e-200}) {
    auto system = test::make_system<3>({10, 10, 10}, Boundary::open, {{5, 5, 5}}, {{0, 0, 1}});
    add(*system, {{"name", std::string("tube")},
                  {"shape", std::string("cylinder")},
                  {"centre", std::vector{5.0, 5.0, 5.0}},
                  {"axis", std::vector{0.0, 0.0, length}},
                  {"radius", 3.0}});
    EXPECT_EQ(system->box.wall(6).direction, Vec<3>(0, 0, 1));
  }
}

TEST(RoundWalls, NeedRoomForASphereToMove) {
  const std::string message = test::message_of([] {
    test::run_until<2>(in_cavity<2>({{5, 5}}, {{0.1, 0}}, {{"radius", 0.5}}), "free-flight", 1, 1);
  });
  EXPECT_NE(message.find("'cavity' has the diameter 1 and no room for a diameter of 1"), std::string::npos) << message;
}

std::string refusal(Parameters given) {
  return test::message_of([&] { in_cavity<3>({{5, 5, 5}}, {{0, 0, 0}}, given); });
}

TEST(RoundWalls, AreRefusedWhereTheyMakeNoSense) {
  EXPECT_EQ(refusal({}), "");
  const auto says = [](const std::string& message, const std::string& part) {
    EXPECT_NE(message.find(part), std::string::npos) << message;
  };
  says(refusal({{"normal", std::vector{0.0, 0.0, 1.0}}}), "is round and has the normal or the offset of a plane");
  says(refusal({{"velocity", 1.0}}), "is round and moves");
  says(refusal({{"one_sided", false}}), "lets spheres be on both sides");
  says(refusal({{"axis", std::vector{0.0, 0.0, 1.0}}}), "is a sphere and has an axis");
  says(refusal({{"shape", std::string("cylinder")}}), "is a cylinder without an axis");
  says(refusal({{"shape", std::string("plane")}}), "is a plane and has keys of a round wall");
  says(refusal({{"centre", std::vector{5.0, 5.0}}}), "has a centre of 2 numbers; give 3");
  says(refusal({{"name", std::string("x-")}}), "'x-'");
  says(test::message_of([] {
         const auto system = in_cavity<3>({{5, 5, 5}}, {{0, 0, 0}});
         system->box.boundary[1] = Boundary::periodic;
         add(*system, {{"name", std::string("tube")},
                       {"shape", std::string("cylinder")},
                       {"centre", std::vector{5.0, 5.0, 5.0}},
                       {"axis", std::vector{0.0, 0.0, 1.0}},
                       {"radius", 3.0}});
       }),
       "along axis 1, which is periodic");
}

}  // namespace
}  // namespace carom::round_walls_test
