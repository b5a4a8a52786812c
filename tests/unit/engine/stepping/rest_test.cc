// SPDX-License-Identifier: BSD-3-Clause
// Bodies at rest: nothing moves, and the reactions are those of statics on any number of ranks.

#include <gtest/gtest.h>

#include <algorithm>
#include <tuple>

#include "engine/forces/forces.h"
#include "engine/ranks/id_blocks.h"
#include "engine/stepping/contact_scan.h"
#include "tests/support/experiments.h"
#include "tests/support/static_scenes.h"
#include "tests/support/thread_ranks.h"

namespace carom::rest_test {
namespace {

constexpr std::int64_t kSteps = 200;
constexpr double kStep = 0.01, kRadius = 0.5;

template <int D>
struct Case {
  const char* name;
  std::function<test::StaticScene<D>()> scene;
};

template <int D>
void PrintTo(const Case<D>& each, std::ostream* out) {
  *out << each.name;
}

/// Expects that these reactions balance the forces on every body.
template <int D>
void expect_balance(const System<D>& system, const std::vector<test::Reaction>& reactions, double error) {
  const auto& p = system.particles;
  std::vector<Vec<D>> left(p.size());
  Counters uncounted;
  evaluate_forces<D>(system, p.x, left, uncounted);
  for (const test::Reaction& each : reactions) {
    EXPECT_GT(each.force, 0);
    const Vec<D> normal =
        each.wall ? system.box.wall(each.hi).normal : Vec<D>((p.x[each.lo] - p.x[each.hi]) / (2 * kRadius));
    left[each.lo] += each.force * normal;
    if (!each.wall) left[each.hi] -= each.force * normal;
  }
  EXPECT_LE(test::largest_difference<D>(left, std::vector<Vec<D>>(p.size(), Vec<D>::Zero())), error);
}

/// Expects the forces of these contacts to a relative error of 1e-10, and no other contact.
void expect_reactions(std::vector<test::Reaction> found, std::vector<test::Reaction> expected) {
  const auto contact = [](const test::Reaction& each) { return std::tuple(each.wall, each.lo, each.hi); };
  std::ranges::sort(found, {}, contact);
  std::ranges::sort(expected, {}, contact);
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t k = 0; k < found.size(); ++k) {
    EXPECT_EQ(contact(found[k]), contact(expected[k]));
    EXPECT_NEAR(found[k].force, expected[k].force, 1e-10 * expected[k].force)
        << expected[k].lo << (expected[k].wall ? " at wall " : " and ") << expected[k].hi;
  }
}

template <int D>
void expect_rest(const Case<D>& each, const std::string& method) {
  SCOPED_TRACE(each.name);
  auto scene = each.scene();
  const auto expected = scene.reactions;
  if (!expected.empty()) expect_balance(*scene.system, expected, 1e-11);
  const auto start = scene.system->particles.x;
  const auto run = test::run_steps<D>(std::move(scene.system), method, kStep, kSteps);
  const Statistics& s = run->statistics();
  EXPECT_LE(test::largest_difference<D>(run->system().particles.x, start), 1e-12 * kRadius);
  EXPECT_LE(s.max_energy_error, 1e-12 * s.energy_reference);
  EXPECT_LE(std::abs(s.energy_after_first_step - s.energy_initial), 1e-12 * s.energy_reference);
  EXPECT_LE(s.counters.max_overlap, 1e-12);
  const auto reactions = test::reactions_of(run->system());
  double largest = 0;
  for (const auto& reaction : reactions) largest = std::max(largest, reaction.force);
  expect_balance(run->system(), reactions, 1e-10 * largest);
  if (!expected.empty()) expect_reactions(reactions, expected);
}

/// Positions and velocities of all particles after the steps on this number of ranks.
template <int D>
Particles<D> at_the_end(const Case<D>& each, int ranks) {
  Particles<D> end;
  test::ThreadRanks(ranks).run([&](Communicator& exchange) {
    auto system = each.scene().system;
    system->decomposition.join(exchange);
    const auto run = test::run_steps<D>(std::move(system), "edda", kStep, kSteps / 4);
    Particles<D> all = gathered(exchange, run->system().particles);
    if (exchange.rank() == 0) end = std::move(all);
  });
  return end;
}

template <int D>
void expect_the_same_on_all_ranks(const Case<D>& each) {
  SCOPED_TRACE(each.name);
  const Particles<D> alone = at_the_end(each, 1);
  for (const int ranks : {2, 3, 4}) {
    const Particles<D> shared = at_the_end(each, ranks);
    EXPECT_EQ(shared.x, alone.x) << ranks << " ranks";
    EXPECT_EQ(shared.v, alone.v) << ranks << " ranks";
  }
}

/// Expects that moving bodies stay in contact: energy is conserved to rounding, and no contact opens.
template <int D>
void expect_held_in_motion(std::unique_ptr<System<D>> system, const std::string& method, std::size_t contacts) {
  const auto run = test::run_steps<D>(std::move(system), method, kStep, 2000);
  const Statistics& s = run->statistics();
  const double rounding = (method == "edda" ? 3e-14 : 1e-13) * s.energy_reference;
  EXPECT_LE(s.max_energy_error, rounding) << method;  // from the end of the first step on
  EXPECT_LE(std::abs(s.energy_after_first_step - s.energy_initial), rounding) << method;
  EXPECT_LE(s.max_momentum_error.value_or(0), 1e-14) << method;
  EXPECT_LE(s.counters.max_overlap, 1e-12) << method;
  EXPECT_EQ(s.counters.sphere_sphere + s.counters.sphere_wall, 0u) << method;
  EXPECT_EQ(test::reactions_of(run->system()).size(), contacts) << method;
}

/// Two discs that attract each other and rotate about each other in contact, free or in a trap, which pulls the lighter
/// disc more strongly and bends the path of the pair.
std::unique_ptr<System<2>> turning_pair(double mass, double trap) {
  auto system = test::make_system<2>({30, 30}, Boundary::open, {{10, 10}, {11, 10}}, {{0.2, -0.5 * mass}, {0.2, 0.5}},
                                     {}, {1, mass});
  test::add_interaction(*system, "gravity", {{"constant", 10.0}});
  if (trap > 0) test::add_interaction(*system, "harmonic-trap", {{"stiffness", trap}});
  return system;
}
/// A column that slides back and forth on the floor in a trap.
std::unique_ptr<System<2>> sliding_column(int n) {
  auto scene = test::in_trap(test::column(n), 0.5);
  for (auto& v : scene.system->particles.v) v = {0.7, 0};
  return std::move(scene.system);
}
TEST(HeldInMotion, TurningPairs) {
  for (const char* method : {"edda", "cdda"})
    for (const double mass : {1.0, 0.2}) expect_held_in_motion(turning_pair(mass, 0), method, 1);
}
TEST(HeldInMotion, ATurningPairInATrap) { expect_held_in_motion(turning_pair(0.2, 0.05), "edda", 1); }
/// A pair in contact in a trap that started from rest, moved for a step of 0.1 and turns back: at the end of the next
/// step it has hardly any kinetic energy.
std::unique_ptr<System<2>> pair_that_turns_back(double attraction, double trap, double mass, double second = 1) {
  const auto pair = [&] {
    auto system =
        test::make_system<2>({30, 30}, Boundary::open, {{10, 10}, {10.6, 10.8}}, {{0, 0}, {0, 0}}, {}, {1, mass});
    test::add_interaction(*system, "gravity", {{"constant", attraction / (second * second)}});
    test::add_interaction(*system, "harmonic-trap", {{"stiffness", trap / (second * second)}});
    return system;
  };
  const auto there = test::run_steps<2>(pair(), "edda", 0.1 * second, 1, {{"tolerance", 0.0}});
  auto back = pair();
  back->particles.x = there->system().particles.x;
  for (std::size_t i = 0; i < 2; ++i) back->particles.v[i] = -there->system().particles.v[i];
  return back;
}
TEST(HeldInMotion, ATurningPointUnderAStrongReactionNeedsNoShorterPieces) {
  // The work of the reaction is 2e-12 by the rounding of positions alone: this is carried over to the next step.
  for (const std::int64_t steps : {1, 2}) {
    const auto run = test::run_steps<2>(pair_that_turns_back(1000, 0.05, 1), "edda", 0.1, steps);
    const Statistics& s = run->statistics();
    EXPECT_EQ(s.counters.pieces, static_cast<std::uint64_t>(steps));
    EXPECT_EQ(s.counters.slabs_halved, 0u);
    const double error = std::abs(s.energy_final - s.energy_initial);
    if (steps == 1)
      EXPECT_GT(error, 1e-12);
    else
      EXPECT_LE(error, 3e-13);  // three roundings of the energy of the pair, 1000
  }
}
TEST(HeldInMotion, ARotationThatTurnsBackLosesNoEnergy) {
  // Unequal masses in a trap rotate. At the end of the step the normal velocity of the pair is as large as the
  // tangential one and cannot be turned into it, so the step is divided.
  // In other units of time the numbers are others, and nothing else.
  for (const double second : {1.0, 0x1p30}) {
    const auto run = test::run_steps<2>(pair_that_turns_back(100, 1, 0.2, second), "edda", 0.1 * second, 1);
    const Statistics& s = run->statistics();
    EXPECT_EQ(s.counters.slabs_halved, 1u);
    // Two roundings of the energy of the pair, 100.
    EXPECT_NEAR(s.energy_final * second * second, s.energy_initial * second * second, 3e-14);
  }
}
TEST(HeldInMotion, WhatAContactLosesWhenItComesToRestIsGivenBack) {
  // The disc hits the floor so slowly that it is stopped; otherwise its weight would press it back at once.
  auto scene = test::in_trap(test::column(1), 0.5);
  scene.system->particles.v[0] = {0.3, -0.9 * std::sqrt(2 * kRestingGap * kRadius)};
  expect_held_in_motion(std::move(scene.system), "edda", 1);
}
TEST(HeldInMotion, SlidingColumns) {
  for (const char* method : {"edda", "cdda"})
    for (const int n : {1, 3, 8}) expect_held_in_motion(sliding_column(n), method, static_cast<std::size_t>(n));
}

template <auto make, int... n>
auto scene = [] { return make(n...); };

const std::vector<Case<2>> kFlat = {{"ColumnOf2", scene<test::column, 2>},
                                    {"ColumnOf5", scene<test::column, 5>},
                                    {"ColumnOf10", scene<test::column, 10>},
                                    {"ColumnOf20", scene<test::column, 20>},
                                    {"PyramidOf3", scene<test::pyramid, 3>},
                                    {"ArchOf1", scene<test::arch, 1>},
                                    {"ArchOf4", scene<test::arch, 4>},
                                    {"HangingChain", scene<test::hanging_chain>},
                                    {"ThreeInARow", scene<test::row_under_attraction, 3>},
                                    {"SevenInARow", scene<test::row_under_attraction, 7>},
                                    {"TrappedCrystalOf12", scene<test::trapped_crystal, 5>}};
const std::vector<Case<2>> kFlatAndLarge = {{"ColumnOf50", scene<test::column, 50>},
                                            {"PyramidOf8", scene<test::pyramid, 8>},
                                            {"Crystal", scene<test::crystal, 500>},
                                            {"TrappedCrystalOf92", scene<test::trapped_crystal, 15>}};
const std::vector<Case<3>> kHeap = {{"HeapOf5", scene<test::heap, 2>}, {"TrappedHeap", scene<test::trapped_heap>}};
const std::vector<Case<3>> kLargeHeap = {{"HeapOf55", scene<test::heap, 5>}};

struct Rest2 : testing::TestWithParam<Case<2>> {};
struct Rest3 : testing::TestWithParam<Case<3>> {};
struct FewAtRest2 : Rest2 {};  // few enough for cdda
struct FewAtRest3 : Rest3 {};
TEST_P(Rest2, Edda) { expect_rest(GetParam(), "edda"); }
TEST_P(Rest3, Edda) { expect_rest(GetParam(), "edda"); }
TEST_P(FewAtRest2, Cdda) { expect_rest(GetParam(), "cdda"); }
TEST_P(FewAtRest3, Cdda) { expect_rest(GetParam(), "cdda"); }
TEST_P(Rest2, EddaOnAnyRanks) { expect_the_same_on_all_ranks(GetParam()); }
TEST_P(Rest3, EddaOnAnyRanks) { expect_the_same_on_all_ranks(GetParam()); }

const auto kLabel = [](const auto& test) { return std::string(test.param.name); };
INSTANTIATE_TEST_SUITE_P(Small, Rest2, testing::ValuesIn(kFlat), kLabel);
INSTANTIATE_TEST_SUITE_P(Large, Rest2, testing::ValuesIn(kFlatAndLarge), kLabel);
INSTANTIATE_TEST_SUITE_P(Small, Rest3, testing::ValuesIn(kHeap), kLabel);
INSTANTIATE_TEST_SUITE_P(Large, Rest3, testing::ValuesIn(kLargeHeap), kLabel);
INSTANTIATE_TEST_SUITE_P(Small, FewAtRest2, testing::ValuesIn(kFlat), kLabel);
INSTANTIATE_TEST_SUITE_P(Small, FewAtRest3, testing::ValuesIn(kHeap), kLabel);

}  // namespace
}  // namespace carom::rest_test
