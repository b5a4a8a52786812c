// SPDX-License-Identifier: BSD-3-Clause
// Contacts that dissipate: the ledger H + dissipated, Haff's law, spheres that come to rest.

#include <gtest/gtest.h>

#include <cmath>

#include "engine/base/error.h"
#include "engine/events/meeting.h"
#include "tests/support/experiments.h"

namespace carom::contact_law_test {
namespace {

using test::message_of, test::set_law;

TEST(ContactLaws, ImpulseGivesBackAFractionOfTheNormalSpeed) {
  ContactLaws laws;
  laws.resize(2, 1);
  const auto law = laws.add({.restitution = 0.6});
  laws.set_pair(0, 1, law);
  laws.set_wall(1, 0, law);
  const Vec<2> d{0.6, 0.8}, v{-1, -3};
  const Partner<2> a{2.0, 0.5, 1}, b{3.0, 0.5, 0};
  const auto met = pair_impulse<2>(laws, d, v, a, b);
  const Vec<2> after = v + met.factor * (1 / 2.0 + 1 / 3.0) * d;
  EXPECT_NEAR(after.dot(d), -0.6 * v.dot(d), 1e-15);
  EXPECT_NEAR(met.dissipated, 0.5 * 1.2 * (1 - 0.36) * v.dot(d) * v.dot(d), 1e-14);
  EXPECT_EQ((pair_impulse<2>(laws, d, v, b, b).dissipated), 0);
  Wall<2> wall{.axis = 0, .normal = {1, 0}, .velocity = 0.5};
  const auto bounced = wall_impulse<2>(laws, wall, v, a, {});
  EXPECT_NEAR(bounced.v[0], 0.5 + 0.6 * 1.5, 1e-15);
  EXPECT_NEAR(0.5 * 2 * (bounced.v.squaredNorm() - v.squaredNorm()),
              bounced.exchange.work - bounced.exchange.dissipated, 1e-14);
}

TEST(ContactLaws, PowerLawIsElasticForSlowApproaches) {
  const ContactLaw ice{.v0 = 0.01, .exponent = 0.234};
  EXPECT_EQ(ice.restitution_at({0.005, 1}, 1, 0), 1);
  EXPECT_NEAR(ice.restitution_at({0.1, 1}, 1, 0), std::pow(10, -0.234), 1e-15);
  EXPECT_EQ((ContactLaw{.restitution = 0.5, .rest_speed = 1e-3}.restitution_at({9e-4, 1}, 1, 1)), 1);
  EXPECT_EQ((ContactLaw{.restitution = 0.5}.restitution_at({2e-8, 1}, 1, 1)), 0.5);
  EXPECT_EQ((ContactLaw{.restitution = 0.5}.restitution_at({0.5e-8, 1}, 1, 0)), 0);
}

TEST(ContactLaws, MistakesAreErrorsWithARemedy) {
  auto system = test::make_system<2>({9, 9}, Boundary::wall, {{2, 2}, {5, 5}}, {{1, 0}, {0, 0}});
  const auto given = [&](const Parameters& law) { return message_of([&] { set_law(*system, law); }); };
  EXPECT_NE(given({{"restitution", 1.5}}).find("'restitution' is 1.5; take at most 1"), std::string::npos)
      << given({{"restitution", 1.5}});
  EXPECT_NE(given({{"restitution", -0.1}}).find("'restitution'"), std::string::npos);
  EXPECT_EQ(given({{"between", std::vector<std::string>{"sand", "*"}}}),
            "'sand' is neither a species nor a wall; give one of: sphere, x-, x+, y-, y+, *");
  EXPECT_NE(given({{"between", std::vector<std::string>{"x-", "x+"}}}).find("are both walls"), std::string::npos);
  EXPECT_NE(given({{"between", std::vector<std::string>{"*"}}}).find("two partners"), std::string::npos);
  for (const double rest_speed : {2.0, 0.5, 0.49}) {
    system = test::make_system<2>({9, 9}, Boundary::wall, {{2, 2}, {5, 5}}, {{1, 0}, {0, 0}});
    set_law(*system, {{"restitution", 0.5}, {"rest_speed", rest_speed}});
    const std::string fast = message_of([&] { test::run_steps<2>(std::move(system), "psa", 0.01, 1); });
    EXPECT_EQ(fast.find("the thermal speed at the start, 0.5") == std::string::npos, rest_speed < 0.5) << fast;
  }
}

/// Conserved: H + dissipated; to rounding in exact methods, at the order of the others.
TEST(DissipativeContacts, LedgerIsClosedInAllMethods) {
  for (const std::string method : {"free-flight", "edda", "cdda", "psa", "cva", "mcva"}) {
    const auto error = [&](double h) {
      auto system = test::hard_spheres<3>(2, 0.3);
      set_law(*system, {{"restitution", 0.8}});
      if (method != "free-flight")
        add_interaction(*system, "yukawa",
                        {{"amplitude", 1.0}, {"kappa", 3.0}, {"cutoff", 1.6}, {"cut", std::string("force-shifted")}});
      auto run = test::run_until<3>(std::move(system), method, h, 1.0);
      const Statistics& s = run->statistics();
      EXPECT_GT(s.counters.dissipated.value(), 0.1 * s.energy_initial) << method;
      EXPECT_NEAR(s.energy_final + s.counters.dissipated.value(), s.energy_initial,
                  2 * s.max_energy_error + 1e-12 * s.energy_reference + s.first_step_error)
          << method;
      return s.max_energy_error / s.energy_reference;
    };
    const bool exact = method == "free-flight" || method == "edda" || method == "cdda";
    const double coarse = error(0.01);
    EXPECT_LT(coarse, exact ? 1e-13 : 1e-2) << method;
    if (!exact) {
      EXPECT_LT(error(0.0025), 0.5 * coarse) << method;
    }
  }
}

/// In the homogeneous cooling state d ln T/d(collisions of a sphere) = −(1 − e²)/3 for a Maxwellian; the first Sonine
/// correction is (1 + 3 a₂/16)/(1 + 3 a₂/16)-like and below 1 % at e = 0.9 (van Noije, Ernst, Granul. Matter 1 (1998)
/// 57). One run of 2048 spheres: the error of ln T is about √(2/(3 N)) = 0.018.
TEST(DissipativeContacts, GasCoolsByHaffsLawOverTenDecades) {
  auto system = test::hard_spheres<3>(8, 0.05);
  const double n = static_cast<double>(system->size());
  set_law(*system, {{"restitution", 0.9}});
  const auto collisions = static_cast<std::uint64_t>(120 * n);
  auto run = test::make_run<3>(std::move(system), "free-flight", {.step = 1.0, .collisions = collisions});
  run->run();
  const Statistics& s = run->statistics();
  const double fall = std::log(s.energy_initial / s.energy_final), of_sphere = 2.0 * 120;
  EXPECT_NEAR(fall / of_sphere, (1 - 0.81) / 3, 0.03 * (1 - 0.81) / 3);
  EXPECT_LT(s.max_energy_error, 1e-14 * s.energy_reference);
  EXPECT_LT(s.steps, 1e6);
}

/// Two spheres of mass 1 and radius 2 at ±10 attract each other, G = 1: they end at rest in contact, at H = −1/4.
TEST(DissipativeContacts, TwoSpheresFallTogetherAndStay) {
  for (const std::string method : {"edda", "cdda", "psa"}) {
    auto system = test::make_system<3>({60, 60, 60}, Boundary::open, {{20, 30, 30}, {40, 30, 30}},
                                       {Vec<3>::Zero(), Vec<3>::Zero()}, {2, 2});
    set_law(*system, {{"restitution", 0.5}, {"rest_speed", 1e-6}});
    add_interaction(*system, "gravity", {{"constant", 1.0}});
    auto run = test::run_until<3>(std::move(system), method, 0.05, 150);
    const Statistics& s = run->statistics();
    const auto& p = run->system().particles;
    EXPECT_NEAR((p.x[1] - p.x[0]).norm(), 4, 1e-12) << method;
    EXPECT_LT((p.v[1] - p.v[0]).norm(), 1e-12) << method;
    EXPECT_NEAR(s.energy_final, -0.25, 1e-12) << method;
    if (method == "psa") continue;
    EXPECT_NEAR(s.counters.dissipated.value(), 0.2, 1e-12) << method;
    EXPECT_LT(s.max_energy_error, 1e-12) << method;
  }
}

/// The lower disc lies on the floor, and the upper one, which hardly moves, is 5e-6 above it. Only the reaction of the
/// floor presses them together, so the first flight shows that they fall back: they are held without another piece. A
/// third disc takes the energy of the slow motion that ends.
TEST(DissipativeContacts, ASmallGapThatWouldCloseIsHeld) {
  auto system = test::make_system<2>({6, 9}, Boundary::wall, {{3, 0.5}, {3, 1.500005}, {1, 6}},
                                     {{0, 0}, {0, 1e-4}, {1, 0}}, {0.5, 0.5, 0.5});
  test::set_law<2>(*system, {{"restitution", 0.5}});
  add_interaction(*system, "uniform-field", {{"acceleration", std::vector<double>{0, -1}}});
  const auto run = test::run_until<2>(std::move(system), "edda", 0.02, 0.02);
  EXPECT_EQ(run->statistics().counters.pieces, 1u);
  EXPECT_EQ(run->statistics().counters.sphere_sphere, 0u);
  EXPECT_NEAR(run->system().particles.x[1][1], 1.500005, 1e-12);
  EXPECT_LT(run->statistics().max_energy_error, 1e-14);
}

/// The energy of a slow motion that would close the contact again within the step is dissipated: nothing else moves
/// that could take it, and the step is not divided.
TEST(DissipativeContacts, WhatOpensSlowlyAndIsHeldLosesItsEnergy) {
  auto system = test::make_system<2>({6, 9}, Boundary::wall, {{3, 0.5}, {3, 1.500003}}, {{0, 0}, {0, 0.004}});
  test::set_law<2>(*system, {{"restitution", 0.5}});
  add_interaction(*system, "uniform-field", {{"acceleration", std::vector<double>{0, -1}}});
  const auto run = test::run_until<2>(std::move(system), "edda", 0.02, 0.1);
  EXPECT_EQ(run->statistics().counters.pieces, 5u);
  EXPECT_EQ(run->statistics().counters.slabs_halved, 0u);
  EXPECT_NEAR(run->statistics().counters.dissipated.value(), 0.5 * 0.004 * 0.004, 1e-15);
  EXPECT_LT(run->statistics().max_energy_error, 1e-14);
  // A column that rises: only the contact with the floor opens, and the discs of unequal masses have more energy than
  // that of a rest speed.
  auto column = test::make_system<2>({6, 9}, Boundary::wall, {{3, 0.5}, {3, 1.5}, {3, 2.5}},
                                     std::vector<Vec<2>>(3, {0, 0.0095}), {}, {1, 3, 2});
  test::set_law<2>(*column, {{"restitution", 0.5}, {"rest_speed", 0.01}});
  add_interaction(*column, "uniform-field", {{"acceleration", std::vector<double>{0, -1}}});
  const auto fell = test::run_until<2>(std::move(column), "edda", 0.02, 0.1);
  EXPECT_EQ(fell->statistics().counters.slabs_halved, 0u);
  EXPECT_NEAR(fell->statistics().counters.dissipated.value(), 0.5 * 6 * 0.0095 * 0.0095, 1e-14);
  EXPECT_LT(fell->statistics().max_energy_error, 1e-13);
}

/// A ball that falls by 1 rests after the first impact that is slower than the rest speed, at the time of the formula
/// 2 v/g for each flight, and stays at rest: in a last step that is shorter, too, and for 100 steps.
TEST(DissipativeContacts, ABallRestsWhenItsImpactsAreSlow) {
  for (const char* method : {"edda", "cdda", "cva", "mcva"})
    for (const double e : {0.3, 0.7, 0.9})
      for (const double rest_speed : {1e-6, 1e-2, 0.1}) {
        SCOPED_TRACE(testing::Message() << method << ", e = " << e << ", rest speed " << rest_speed);
        double time = std::sqrt(2.0);
        std::uint64_t impacts = 0;
        for (double speed = time; speed >= rest_speed; time += 2 * speed, ++impacts) speed *= e;
        auto system = test::make_system<2>({5, 5}, Boundary::wall, {{2.5, 1.5}}, {{0, 0}});
        test::set_law<2>(*system, {{"restitution", e}, {"rest_speed", rest_speed}});
        add_interaction(*system, "uniform-field", {{"acceleration", std::vector<double>{0, -1}}});
        const auto run = test::run_until<2>(std::move(system), method, 0.02, time + 2.003);
        EXPECT_EQ(run->statistics().counters.sphere_wall, impacts);
        EXPECT_LT(run->system().particles.v[0].norm(), 1e-12);
        EXPECT_NEAR(run->system().particles.x[0][1], 0.5, 1e-5 * 0.5);  // the gap from which approaches stop
      }
}

/// What pieces with contacts at rest leave is folded: without this, the ledger of these discs is open by 9e-13.
TEST(DissipativeContacts, CddaFoldsTheRoundingOfAPile) {
  auto system = test::make_system<2>({8.737, 15.2}, Boundary::periodic,
                                     {{0.74, 0.583},
                                      {2.161, 0.551},
                                      {3.633, 0.587},
                                      {5.082, 0.575},
                                      {6.542, 0.592},
                                      {8.036, 0.57},
                                      {0.758, 1.973},
                                      {2.203, 2.014}},
                                     {{-0.7, 0.41},
                                      {0.12, 0.91},
                                      {-0.58, 0.08},
                                      {0.76, 0.28},
                                      {-0.38, -0.84},
                                      {0.88, -0.05},
                                      {0.99, -0.72},
                                      {0.62, 0.63}},
                                     std::vector<double>(8, 0.45));
  system->box.boundary[1] = Boundary::wall;
  test::set_law<2>(*system, {{"restitution", 0.5}, {"rest_speed", 0.01}});
  add_interaction(*system, "uniform-field", {{"acceleration", std::vector<double>{0, -1}}});
  const auto run = test::run_until<2>(std::move(system), "cdda", 0.02, 12);
  EXPECT_LT(run->statistics().counters.max_overlap, 1e-12);
  EXPECT_LT(run->statistics().max_energy_error, 1e-13);
}

/// A light disc comes to rest on a heavy one that lies on the floor. Both fall alike, so only the reaction of the floor
/// presses them together; without it each kick would throw the light disc up again.
TEST(DissipativeContacts, KicksSustainNoBounceOnWhatLiesOnTheFloor) {
  for (int k = 0; k < 10; ++k) {
    auto system = test::make_system<2>({6, 9}, Boundary::wall, {{3, 0.5}, {3, 1.515 + 0.001 * k}}, {{0, 0}, {0, 0}}, {},
                                       {1e6, 1});
    test::set_law(*system, {{"restitution", 0.15}, {"rest_speed", 0.02}});
    add_interaction(*system, "uniform-field", {{"acceleration", std::vector<double>{0, -1}}});
    const auto run = test::run_until<2>(std::move(system), "psa", 0.1, 10);
    EXPECT_LE(run->statistics().counters.sphere_sphere, 3u) << k;
    EXPECT_NEAR(run->system().particles.x[1][1], 1.50125, 0.00126) << k;  // a gap up to g h²/4 is held
    EXPECT_NEAR(run->system().particles.v[1][1], 0, 1e-12) << k;
  }
}

/// Discs that touch within a step and are apart again at its end have collided, however little they would overlap.
TEST(DissipativeContacts, GrazingDiscsCollideWithinAStep) {
  for (const std::string method : {"free-flight", "edda", "cdda", "psa"})
    for (const double offset : {0.5, 0.9, 0.9999}) {
      auto system = test::make_system<2>({20, 20}, Boundary::periodic, {{5, 5}, {8, 5 + offset}}, {{4, 0}, {0, 0}});
      set_law(*system, {{"restitution", 0.5}});
      const double normal_speed = 4 * std::sqrt(1 - offset * offset);
      const auto run = test::run_steps<2>(std::move(system), method, 1.0, 1);
      EXPECT_EQ(run->statistics().counters.sphere_sphere, 1u) << method << " " << offset;
      EXPECT_NEAR(run->statistics().counters.dissipated.value(), 0.25 * 0.75 * normal_speed * normal_speed, 1e-12)
          << method << " " << offset;
    }
}

/// Three bodies in a line collapse for e < 7 − 4√3 (Zhou, Kadanoff, Phys. Rev. E 54 (1996) 623): the run must end.
TEST(DissipativeContacts, CollapseOfThreeBodiesEnds) {
  for (const std::string method : {"free-flight", "psa", "edda", "cdda"})
    for (const double e : {0.05, 0.09}) {
      auto system =
          test::make_system<2>({40, 4}, Boundary::open, {{10, 2}, {20, 2}, {30, 2}}, {{1, 0}, {0, 0}, {-1, 0}});
      set_law(*system, {{"restitution", e}});
      auto run = test::run_until<2>(std::move(system), method, 0.1, 30);
      const Statistics& s = run->statistics();
      EXPECT_LT(s.max_energy_error, 1e-13) << method;
      EXPECT_LT(s.energy_final, 0.1) << method;
    }
}

}  // namespace
}  // namespace carom::contact_law_test
