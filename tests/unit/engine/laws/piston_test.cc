// SPDX-License-Identifier: BSD-3-Clause
// Moving walls: every bounce, the work and the energy against exact results.

#include <gtest/gtest.h>

#include <cmath>

#include "engine/base/error.h"
#include "engine/forces/add_interaction.h"
#include "engine/ranks/id_blocks.h"
#include "tests/support/experiments.h"
#include "tests/support/thread_ranks.h"
#include "tests/unit/engine/laws/contact_collector.h"

namespace carom::piston_test {
namespace {

constexpr double kRadius = 0.5, kMass = 2;

/// One sphere that moves back and forth along axis 0 between a fixed wall and a piston.
std::unique_ptr<System<2>> one_sphere(double length, double speed, double piston) {
  auto system = std::make_unique<System<2>>();
  system->box.edges = {length, 3};
  if (piston != 0) system->box.add({.name = "x+", .velocity = -piston});
  system->particles.add({.x = {kRadius, 1.5}, .v = {speed, 0}, .radius = kRadius, .mass = kMass});
  return system;
}

/// The piston moves at speed u. From one contact to the next, with the speed v before and the free length ℓ of the
/// centre, the sphere takes 2ℓ/(v + 3u) and conserves (v + u)ℓ: the exact form of the adiabatic invariant v ℓ of slow
/// pistons.
void expect_exact_bounces(const std::string& method, double step, double tolerance) {
  const double length = 10, u = 0.0625, end = 100;
  auto run = test::make_run<2>(one_sphere(length, 1.3, -u), method, {.step = step, .end_time = end, .events = true});
  test::ContactCollector log;
  run->add(log);
  run->run();
  double time = (length - 2 * kRadius) / (1.3 + u), v = 1.3, room = length - 2 * kRadius - u * time, work = 0;
  const double invariant = (v + u) * room;
  std::size_t met = 0;
  for (const Contact<2>& contact : log.all) {
    if (contact.key.hi != 1) continue;
    ++met;
    EXPECT_NEAR(contact.key.time, time, tolerance * end);
    EXPECT_NEAR(contact.x_hi[0], length - u * time, tolerance * length);
    EXPECT_NEAR(contact.x_lo[0], contact.x_hi[0] - kRadius, tolerance * length);
    const double before = -contact.impulse[0] / (2 * kMass) - u;
    EXPECT_NEAR((before + u) * (contact.x_hi[0] - 2 * kRadius), invariant, tolerance * invariant);
    EXPECT_NEAR(contact.impulse[0], -2 * kMass * (v + u), tolerance);
    EXPECT_NEAR(contact.exchange.work, 2 * kMass * u * (v + u), tolerance);  // ½m ((v + 2u)² − v²)
    work += contact.exchange.work;
    const double next = 2 * room / (v + 3 * u);
    time += next;
    room -= u * next;
    v += 2 * u;
  }
  EXPECT_GT(met, 10u);
  EXPECT_GT(time, end);  // no contact is missing
  const Statistics& s = run->statistics();
  EXPECT_NEAR(s.counters.work.value(), work, 1e-13 * work);
  EXPECT_NEAR(s.energy_final - s.energy_initial, work, 1e-14 * s.energy_final);
  EXPECT_GT(work, 2 * s.energy_initial);
  EXPECT_TRUE(std::isnan(s.mean_pressure));  // the volume varies
  EXPECT_LE(s.max_energy_error, 1e-14 * s.energy_final);
  EXPECT_NEAR(run->system().box.lengths(end)[0], length - u * end, 1e-12);
  const double ends = std::abs(run->system().particles.v[0][0]) * (length - u * end - 2 * kRadius);
  EXPECT_NEAR(ends, 1.3 * (length - 2 * kRadius), 2 * u / 1.3 * ends);  // the adiabatic invariant, for a slow piston
}

TEST(Piston, EveryBounceIsExactInFreeFlight) {
  expect_exact_bounces("free-flight", 100, 1e-13);
  expect_exact_bounces("free-flight", 7, 1e-13);
}

TEST(Piston, EveryBounceIsExactInStepsOfPsa) { expect_exact_bounces("psa", 0.25, 1e-12); }

TEST(Piston, GivesWayAndTakesEnergy) {
  for (const std::string method : {"free-flight", "psa"}) {
    const auto run = test::run_until<2>(one_sphere(4, 2, 0.5), method, 0.5, 20);
    const Statistics& s = run->statistics();
    EXPECT_LT(s.counters.work.value(), 0) << method;
    EXPECT_LE(s.max_energy_error, 1e-14 * s.energy_initial) << method;
    EXPECT_GE(run->system().box.lengths(20)[0] - kRadius - run->system().particles.x[0][0], 0) << method;
  }
}

/// The piston hits a sphere at rest, but not one that moves away as fast as the piston.
TEST(Piston, MeetsWhatIsAtRest) {
  for (const std::string method : {"free-flight", "psa"}) {
    auto system = one_sphere(4, 0, -1);
    system->particles.add({.x = {2, 0.5}, .v = {-1, 0}, .radius = 0.1});
    system->particles.x[0][0] = 3;
    const auto run = test::run_until<2>(std::move(system), method, 0.75, 1.5);
    EXPECT_EQ(run->statistics().counters.sphere_wall, 1u) << method;
    EXPECT_NEAR(run->system().particles.x[0][0], 3 - 2 * (1.5 - 0.5), 1e-13) << method;
    EXPECT_NEAR(run->statistics().counters.work.value(), 0.5 * kMass * 4, 1e-13) << method;
  }
}

/// A row of spheres on springs between two pistons, with forces in all methods.
std::unique_ptr<System<2>> springs() {
  auto system = test::make_system<2>({8, 4}, Boundary::wall, {{4, 2}, {6, 2.5}}, {{1.5, 0.4}, {0.5, -0.3}});
  system->box.add({.name = "x+", .velocity = 0.3});
  system->box.add({.name = "y-", .velocity = -0.1});
  add_interaction(*system, "harmonic-bond", {{"chain", true}, {"stiffness", 4.0}, {"rest_length", 2.0}});
  return system;
}

/// edda and cdda conserve H − W to rounding whatever the step, with forces.
TEST(Piston, EnergyAndWorkAddUpToRounding) {
  for (const std::string method : {"edda", "cdda"})
    for (const double h : {0.01, 0.1}) {
      const auto run = test::run_until<2>(springs(), method, h, 6);
      const Statistics& s = run->statistics();
      EXPECT_GT(std::abs(s.counters.work.value()), 0.5) << method;
      EXPECT_GT(s.counters.sphere_wall, 3u) << method;
      EXPECT_LT(s.max_energy_error, 1e-12 * s.energy_reference) << method << " " << h;
    }
}

/// All other methods conserve H − W to their order, with forces.
TEST(Piston, EnergyAndWorkAddUpToTheOrderOfTheMethod) {
  for (const std::string method : {"psa", "cva", "mcva"}) {
    const auto error = [&](double h) {
      return test::run_until<2>(springs(), method, h, 6)->statistics().max_energy_error;
    };
    const double factor = method == "psa" ? 0.5 : 0.1;
    EXPECT_LT(error(0.001), 0.02) << method;
    EXPECT_LT(error(0.0002), factor * error(0.001)) << method;
  }
}

/// A sphere lies on a floor that rises, under gravity: the floor carries it and does the work m g u t.
TEST(Piston, CarriesWhatLiesOnIt) {
  for (const std::string method : {"cva", "mcva", "cdda", "edda"}) {
    auto system = test::make_system<2>({4, 9}, Boundary::wall, {{1.2, 0.5}, {2.4, 0.5}}, {{0, 0.25}, {0, 0.25}});
    system->box.add({.name = "y-", .velocity = 0.25});
    add_interaction(*system, "uniform-field", {{"acceleration", std::vector<double>{0, -1}}});
    const auto run = test::run_until<2>(std::move(system), method, 0.05, 8);
    const Statistics& s = run->statistics();
    EXPECT_NEAR(s.counters.work.value(), 2 * 0.25 * 8, 1e-11) << method;
    EXPECT_LT(s.max_energy_error, 1e-12 * s.energy_reference) << method;
    EXPECT_NEAR(run->system().particles.x[0][1], 0.5 + 0.25 * 8, 1e-12) << method;
    EXPECT_LT(s.counters.sphere_wall, 5u) << method;
  }
}

/// All methods give the same bits on any number of ranks.
TEST(Piston, GivesTheSameBitsOnAnyRanks) {
  for (const std::string method : {"psa", "cva", "edda", "free-flight"}) {
    const auto result = [&](int count) {
      std::vector<Vec<2>> x;
      test::ThreadRanks(count).run([&](Communicator& ranks) {
        auto system = test::make_system<2>({24, 8}, Boundary::wall, {}, {});
        for (int k = 0; k < 40; ++k)
          system->particles.add({.x = {1.2 + 2.3 * (k % 10), 1 + 1.6 * (k / 10)},
                                 .v = {0.4 - 0.07 * (k * 7 % 13), 0.03 * (k * 5 % 11) - 0.2}});
        system->box.add({.name = "x+", .velocity = 0.4});
        system->box.add({.name = "y-", .velocity = -0.1});
        if (method != "free-flight")
          add_interaction(*system, "yukawa", {{"amplitude", 0.2}, {"kappa", 2.0}, {"cutoff", 2.0}});
        if (count > 1) system->decomposition.join(ranks);
        const auto run = test::run_until<2>(std::move(system), method, 0.1, 8);
        EXPECT_GT(run->statistics().counters.work.value(), 0);
        auto all = gathered(ranks, run->system().particles);
        if (ranks.rank() == 0) x = all.x;
      });
      return x;
    };
    const auto one = result(1);
    for (const int count : {2, 3, 4}) EXPECT_EQ(result(count), one) << method << " " << count;
  }
}

/// The error message of a wall that is refused.
std::string message(const WallOptions<2>& wall, Boundary boundary = Boundary::wall) {
  Box<2> box{.edges = {10, 10}, .boundary = {boundary, Boundary::wall}};
  try {
    box.add(wall);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Walls, AreRefusedWhereTheyMeanNothing) {
  EXPECT_EQ(message({.name = "x+", .velocity = 1}, Boundary::periodic),
            "the wall 'x+' does not exist, because that boundary is periodic; make that boundary a wall");
  EXPECT_EQ(message({.name = "z+"}),
            "the wall 'z+' is no face of the box and has no normal; give a normal that is not zero, or the name of a "
            "face: x-, x+, y-, y+");
  EXPECT_EQ(message({.name = "x+", .normal = {1, 0}}),
            "the wall 'x+' is a face of the box, which has its normal, its place and one side; leave shape, normal, "
            "offset and "
            "one_sided out, or choose another name");
  EXPECT_EQ(message({.name = "ramp", .normal = {1, 1}}), "");
}

}  // namespace
}  // namespace carom::piston_test
