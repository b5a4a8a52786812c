// SPDX-License-Identifier: BSD-3-Clause
// The engine as a library: mistakes that a program can make, and their errors.

#include <carom/carom.h>
#include <gtest/gtest.h>

namespace carom::library_test {
namespace {

std::unique_ptr<System<2>> two_discs() {
  auto system = std::make_unique<System<2>>();
  system->box.edges = {6, 4};
  system->particles.add({.x = {2, 2}, .v = {1, 0}});
  system->particles.add({.x = {4, 2}});
  return system;
}

/// The message of the error that this throws; empty if it throws nothing.
template <class Action>
std::string message(Failure failure, Action&& action) {
  try {
    action();
  } catch (const Error& error) {
    EXPECT_EQ(error.failure(), failure) << error.what();
    return error.what();
  }
  return "";
}

std::string run_message(Failure failure, const std::function<void(System<2>&)>& change, const char* integrator = "psa",
                        const Parameters& given = {{"step", 0.1}}, const Plan& plan = {.steps = 1}) {
  return message(failure, [&] {
    auto system = two_discs();
    change(*system);
    Simulation<2>(std::move(system), integrator, given, plan).run();
  });
}

void expect_says(const std::string& message, const std::string& part) {
  EXPECT_NE(message.find(part), std::string::npos) << "\"" << message << "\" does not say \"" << part << '"';
}

TEST(Library, FiveSpringsKeepTheirEnergy) {
  auto system = std::make_unique<System<2>>();
  system->box.edges = {12, 6};
  for (int k = 0; k < 5; ++k) system->particles.add({.x = {2.0 + 2 * k, 3.0}});
  system->particles.v[1] = {1.1, -0.4};
  system->particles.v[3] = {-0.7, 0.9};
  add_interaction(*system, "harmonic-bond", {{"chain", true}, {"stiffness", 1.0}, {"rest_length", 2}});
  Simulation<2> run(std::move(system), "edda", {{"step", 0.01}}, {.end_time = 6});
  run.run();
  EXPECT_LE(run.statistics().max_energy_error, 1e-13 * run.statistics().energy_reference);
  EXPECT_GT(run.statistics().counters.sphere_sphere, 0u);
}

TEST(Library, FreeFlightChoosesItsEpoch) {
  Simulation<2> run(two_discs(), "free-flight", {}, {.end_time = 3});
  run.run();
  EXPECT_NEAR(run.system().particles.x[0][0], 3, 1e-12);  // the first disc stopped at contact, t = 1
  EXPECT_EQ(run.statistics().counters.sphere_sphere, 1u);
}

TEST(Library, MistakesAreErrorsWithARemedy) {
  EXPECT_EQ(run_message(Failure::deck, [](auto&) {}), "");
  const auto none = [](auto&) {};
  expect_says(run_message(Failure::deck, none, "leapfrog"),
              "unknown integrator 'leapfrog'; give one of: free-flight, ");
  expect_says(run_message(Failure::deck, none, "psa", {{"step", 0.1}, {"order", 4}}),
              "unknown parameter of psa 'order'; give one of: step, ");
  expect_says(run_message(Failure::deck, none, "psa", {}), "psa: missing parameter 'step'; give it: ");
  expect_says(run_message(Failure::deck, none, "psa", {{"step", 0.1}}, {.step = 0.1, .steps = 1}), "given twice");
  expect_says(run_message(Failure::deck, none, "psa", {{"step", "long"}}), "'step' is a text; give a number");
  expect_says(run_message(Failure::deck, none, "psa", {{"step", -1.0}}),
              "'step' must be positive (is -1); give a number above 0");
  expect_says(run_message(Failure::deck, none, "cdda", {{"step", 0.1}, {"order", 3}}), "'order' cannot be '3'");
  expect_says(run_message(Failure::deck, none, "mcva", {{"step", 0.1}, {"variant", "other"}}), "give one of: grid");
  expect_says(run_message(Failure::deck, none, "psa", {{"step", 0.1}}, {}), "the run has no end");
  expect_says(run_message(Failure::deck, none, "verlet", {{"step", 0.1}}, {.collisions = 5}),
              "'verlet' has no collisions, the run would never end; give steps or end_time");
  expect_says(run_message(Failure::initial_state, [](auto& s) { s.particles.mass.pop_back(); }),
              "'mass' of the particles has 1 entries, x has 2; give each particle one");
  expect_says(run_message(Failure::initial_state, [](auto& s) { s.particles.mass[1] = 0; }), "mass of particle 1");
  expect_says(run_message(Failure::initial_state, [](auto& s) { s.particles.x[0][0] = std::nan(""); }),
              "position of particle 0");
  expect_says(run_message(Failure::initial_state, [](auto& s) { s.particles.x[1][0] = 2.5; }),
              "particles 0 and 1 overlap");
  expect_says(run_message(Failure::initial_state, [](auto& s) { s.particles.x[1][0] = 5.8; }),
              "beyond the upper wall of axis 0");
  expect_says(run_message(Failure::initial_state, [](auto& s) { s.box.edges[1] = 0; }), "edge of the box along axis 1");
  expect_says(run_message(Failure::initial_state, [](auto& s) { s.particles.species[1] = 1; }),
              "species of particle 1");
  expect_says(run_message(Failure::initial_state,
                          [](auto& s) {
                            s.box.boundary.fill(Boundary::periodic);
                            s.box.edges[1] = 0.9;
                          }),
              "the periodic box is 0.9 long on axis 1, less than a diameter of 1");
  expect_says(run_message(Failure::deck, [](auto& s) { add_interaction(s, "springs", {}); }),
              "unknown interaction 'springs'; give one of: harmonic-bond, ");
  const auto with_gravity = [](auto& s) { add_interaction(s, "gravity", {{"constant", 1.0}}); };
  expect_says(run_message(Failure::deck, with_gravity, "free-flight", {}), "knows no forces but a uniform-field");
}

TEST(Library, AForceThatTheMethodRefusesLeavesTheSystemToTheCaller) {
  auto system = two_discs();
  add_interaction(*system, "gravity", {{"constant", 1.0}});
  EXPECT_THROW(Simulation<2>(std::move(system), "free-flight", {}, {.end_time = 3}), Error);
  ASSERT_NE(system, nullptr);
  Simulation<2>(std::move(system), "psa", {{"step", 0.1}}, {.end_time = 1}).run();
}

TEST(Library, EveryDefaultCanBeRead) {
  const auto complete = [](const auto& info) {
    Parameters given;
    for (const Parameter& p : info.parameters) {
      if (!p.fallback.empty()) continue;
      if (p.type == Parameter::Type::real) given.set(std::string(p.name), 1.0);
      if (p.type == Parameter::Type::integer) given.set(std::string(p.name), std::int64_t{1});
      if (p.type == Parameter::Type::real_list) given.set(std::string(p.name), std::vector<double>{1.0});
    }
    const Parameters all = completed(info.name, info.parameters, given);
    for (const Parameter& p : info.parameters) EXPECT_EQ(all.has(p.name), p.fallback != "none") << p.name;
  };
  for (const auto& info : integrators()) complete(info);
  for (const auto& info : interactions()) complete(info);
}

}  // namespace
}  // namespace carom::library_test
