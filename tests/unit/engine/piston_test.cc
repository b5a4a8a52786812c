// SPDX-License-Identifier: BSD-3-Clause
// Moving walls: every bounce, the work and the energy against exact results.

#include <gtest/gtest.h>

#include <cmath>

#include "engine/base/error.h"
#include "engine/forces/add_interaction.h"
#include "tests/support/experiments.h"
#include "tests/support/thread_ranks.h"

namespace carom {
namespace {

constexpr double kRadius = 0.5, kMass = 2;

/// One sphere that moves back and forth along axis 0 between a fixed wall and a piston.
std::unique_ptr<System<2>> one_sphere(double length, double speed, double piston) {
  auto system = std::make_unique<System<2>>();
  system->box.edges = {length, 3};
  system->box.edge_velocity[0] = piston;
  system->particles.add({.x = {kRadius, 1.5}, .v = {speed, 0}, .radius = kRadius, .mass = kMass});
  return system;
}

/// Collects contacts, with times since the start of the run.
class Log : public Observer<2> {
 public:
  void contacts(double start, std::span<const Contact<2>> more) override {
    for (Contact<2> contact : more) {
      contact.key.time += start;
      all.push_back(contact);
    }
  }
  std::vector<Contact<2>> all;
};

/// The piston moves at speed u. From one contact to the next, with the speed v before and the free length ℓ of the
/// centre, the sphere takes 2ℓ/(v + 3u) and conserves (v + u)ℓ: the exact form of the adiabatic invariant v ℓ of slow
/// pistons.
void expect_exact_bounces(const std::string& method, double step, double tolerance) {
  const double length = 10, u = 0.0625, end = 100;
  auto run = test::make_run<2>(one_sphere(length, 1.3, -u), method, {.step = step, .end_time = end, .events = true});
  Log log;
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
    EXPECT_NEAR(contact.virial, 2 * kMass * u * (v + u), tolerance);  // ½m ((v + 2u)² − v²)
    work += contact.virial;
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
  EXPECT_NEAR(run->system().box.edges[0], length - u * end, 1e-12);
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
    EXPECT_GE(run->system().box.edges[0] - kRadius - run->system().particles.x[0][0], 0) << method;
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

/// psa conserves H − W to its order, with forces.
TEST(Piston, EnergyAndWorkAddUpUnderForces) {
  const auto error = [](double h) {
    auto system = test::make_system<2>({8, 4}, Boundary::wall, {{4, 2}, {6, 2.5}}, {{1.5, 0.4}, {0.5, -0.3}});
    system->box.edge_velocity = {-0.3, 0.1};
    add_interaction(*system, "harmonic-bond", {{"chain", true}, {"stiffness", 4.0}, {"rest_length", 2.0}});
    const auto run = test::run_until<2>(std::move(system), "psa", h, 6);
    EXPECT_GT(std::abs(run->statistics().counters.work.value()), 0.05);
    return run->statistics().max_energy_error;
  };
  EXPECT_LT(error(0.001), 0.01);
  EXPECT_LT(error(0.0002), 0.5 * error(0.001));
}

/// The error message of a run that throws.
std::string message(const std::function<void(System<2>&)>& change, const std::string& method,
                    Communicator* ranks = nullptr) {
  auto system = one_sphere(10, 1, -0.1);
  if (ranks) system->decomposition.join(*ranks);
  change(*system);
  try {
    system->check();
    test::run_until<2>(std::move(system), method, 0.1, 1);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Piston, IsRefusedWhereItIsNotKnown) {
  const auto as_it_is = [](System<2>&) {};
  for (const std::string method : {"cva", "mcva", "cdda", "edda"})
    EXPECT_EQ(message(as_it_is, method), "this method knows no walls that move; take free-flight or psa, or stop them");
  const auto periodic = [](System<2>& system) { system.box.boundary[0] = Boundary::periodic; };
  EXPECT_EQ(message(periodic, "psa"),
            "the edge of the box along axis 0 moves at -0.1; only walls can move, at finite speeds: make that boundary "
            "a wall, or its edge_velocity 0");
  test::ThreadRanks(2).run([&](Communicator& ranks) {
    EXPECT_EQ(message(as_it_is, "psa", &ranks),
              "forces and walls that move together need one rank; take one, or free-flight");
    EXPECT_EQ(message(as_it_is, "free-flight", &ranks), "");
  });
}

}  // namespace
}  // namespace carom
