// SPDX-License-Identifier: BSD-3-Clause
// Which pairs a term sums over, their order, and what a deck must not request.

#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "engine/forces/potentials/lennard_jones.h"
#include "tests/unit/potentials/scene.h"

namespace carom::pairs_test {
namespace {

using namespace std::string_literals;
using test::energy;
using test::forces;
using test::Scene;

using Given = std::vector<std::pair<std::string, ParameterValue>>;
using Names = std::vector<std::string>;

/// The message of the Error(Failure::deck) that making this interaction throws.
template <int D>
std::string refusal(const Scene<D>& scene, const std::string& type, const Given& given) {
  try {
    scene.make(type, given);
  } catch (const Error& error) {
    EXPECT_EQ(error.failure(), Failure::deck);
    return error.what();
  }
  return "accepted";
}

void expect_contains(const std::string& message, const std::string& part) {
  EXPECT_NE(message.find(part), std::string::npos) << "'" << message << "' does not say '" << part << "'";
}

const Given kLennardJones = {{"epsilon", 1.0}, {"sigma", 0.8}, {"cutoff", 2.0}, {"cut", "shifted"s}};

TEST(Pairs, WithinACutoffAreThoseOfTheDoubleLoop) {
  Scene<3> scene(300, 8, Boundary::periodic, 0.7);
  const auto term = scene.make("lennard-jones", kLennardJones);
  const LennardJones potential(1.0, 0.8);
  const auto& x = scene.particles.x;
  double expected = 0;
  std::uint64_t pairs = 0;
  for (std::size_t i = 0; i < x.size(); ++i)
    for (std::size_t j = i + 1; j < x.size(); ++j) {
      const double rho = scene.nearest(x[i] - x[j]).squaredNorm();
      if (rho >= 4) continue;
      expected += potential.value(rho) - potential.value(4.0);
      ++pairs;
    }
  EXPECT_NEAR(energy(*term, x), expected, 1e-11 * std::abs(expected));
  EXPECT_EQ(term->interacting_pairs(x), pairs);
}

TEST(Pairs, ForcesDoNotDependOnTheHistoryOfTheNeighbourList) {
  Scene<2> scene(200, 14, Boundary::periodic, 0.7);
  const auto travelled = scene.make("lennard-jones", kLennardJones);
  auto x = scene.particles.x;
  const auto drift = scene.random_vectors(0.004);
  for (int step = 0; step < 40; ++step) {
    x = test::displaced(x, drift, 1);
    if (step % 10 == 9)
      for (auto& each : x) {
        Image<2> image{};
        scene.box.wrap(each, image);
      }
    const auto f = forces(*travelled, x);
    const auto fresh = forces(*scene.make("lennard-jones", kLennardJones), x);
    for (std::size_t i = 0; i < x.size(); ++i) ASSERT_EQ(f[i], fresh[i]) << "particle " << i << ", step " << step;
  }
}

TEST(Pairs, AreCounted) {
  const Scene<2> scene(12, 6, Boundary::wall, 0.5);
  const auto& x = scene.particles.x;  // species: every third is B, that is 4 B and 8 A
  EXPECT_EQ(scene.make("gravity", {{"constant", 1.0}})->interacting_pairs(x), 66u);
  EXPECT_EQ(scene.make("gravity", {{"constant", 1.0}, {"species", Names{"B", "A"}}})->interacting_pairs(x), 32u);
  EXPECT_EQ(scene.make("gravity", {{"constant", 1.0}, {"species", Names{"B", "B"}}})->interacting_pairs(x), 6u);
  EXPECT_EQ(
      scene.make("harmonic-bond", {{"chain", true}, {"stiffness", 1.0}, {"rest_length", 1.0}})->interacting_pairs(x),
      11u);
  EXPECT_EQ(scene
                .make("harmonic-bond",
                      {{"chain", true}, {"chain_length", std::int64_t{4}}, {"stiffness", 1.0}, {"rest_length", 1.0}})
                ->interacting_pairs(x),
            9u);
  EXPECT_EQ(scene.make("harmonic-trap", {{"stiffness", 1.0}})->interacting_pairs(x), 12u);
}

TEST(Pairs, ABondReachesAcrossThePeriodicEdge) {
  Scene<2> scene(2, 10, Boundary::periodic, 0.5);
  scene.particles.x = {Vec<2>(0.5, 5), Vec<2>(9.5, 5)};
  const auto bond = scene.make("harmonic-bond", {{"chain", true}, {"stiffness", 2.0}, {"rest_length", 0.0}});
  EXPECT_EQ(energy(*bond, scene.particles.x), 1.0);
  EXPECT_EQ(forces(*bond, scene.particles.x)[0], Vec<2>(-2, 0));
}

TEST(Pairs, BondsWithinADistanceJoinTheNeighboursOfALattice) {
  Scene<2> scene(16, 8, Boundary::periodic, 0.5);
  for (int i = 0; i < 16; ++i) scene.particles.x[i] = Vec<2>(0.5 + 2 * (i / 4), 0.5 + 2 * (i % 4));
  const Given lattice = {{"within", 2.1}, {"stiffness", 2.0}, {"rest_length", 1.0}};
  const auto bonds = scene.make("harmonic-bond", lattice);
  EXPECT_EQ(bonds->interacting_pairs(scene.particles.x), 32u);  // two per particle, also across the edges
  EXPECT_DOUBLE_EQ(energy(*bonds, scene.particles.x), 32);
}

TEST(Pairs, APairByHand) {  // Lennard-Jones at r = 1.3: V = 4 (1.3⁻¹² − 1.3⁻⁶), d·F = 24 (2·1.3⁻¹² − 1.3⁻⁶)
  Scene<3> scene(2, 10, Boundary::open, 0.5);
  scene.particles.x = {Vec<3>(1, 1, 1), Vec<3>(1, 2.3, 1)};
  const auto term = scene.make("lennard-jones", {{"epsilon", 1.0}, {"sigma", 1.0}});
  const auto at = test::sums(*term, scene.particles.x);
  EXPECT_NEAR(at.energy.value(), -0.6570169145, 1e-9);
  EXPECT_NEAR(at.virial.value(), -2.9119739087, 1e-9);
  EXPECT_NEAR(forces(*term, scene.particles.x)[0][1], 2.9119739087 / 1.3, 1e-9);  // towards the other
}

TEST(Pairs, AYukawaTermWithChargesIsTheirProductTimesThatWithout) {
  Scene<3> scene(2, 10, Boundary::open, 0.5);
  scene.particles.x = {Vec<3>(1, 1, 1), Vec<3>(1, 1, 3)};
  scene.particles.charge = {2, -0.5};
  const Given given = {{"amplitude", 3.0}, {"kappa", 0.5}};
  const auto with = [&](bool charges) {
    Given all = given;
    all.emplace_back("charges", charges);
    return scene.make("yukawa", all);
  };
  const double v = 1.5 * std::exp(-1.0);
  EXPECT_NEAR(energy(*with(false), scene.particles.x), v, 1e-13);
  EXPECT_NEAR(energy(*with(true), scene.particles.x), -v, 1e-13);
  EXPECT_NEAR(forces(*with(true), scene.particles.x)[0][2], v * (1 + 0.5 * 2) / 2, 1e-13);  // attracted
  EXPECT_NEAR(test::sums(*with(true), scene.particles.x).virial.value(), -2 * v, 1e-13);
}

TEST(Pairs, TailsCountThePairsOfTheirSpecies) {
  Scene<3> scene(12, 10, Boundary::periodic, 0.5);  // 8 A and 4 B; charges alternate between 1 and −0.5
  Given given = {{"epsilon", 1.0}, {"sigma", 1.0}, {"cutoff", 2.0}, {"cut", "shifted"s}, {"tail", true}};
  const auto tail = [&](const Names& names) {
    Given all = given;
    if (!names.empty()) all.emplace_back("species", names);
    return scene.make("lennard-jones", all)->tail();
  };
  const double pair = 4 * std::numbers::pi / 1000 * 4 * (std::pow(2, -9) / 9 - std::pow(2, -3) / 3);
  EXPECT_NEAR(tail({}).energy, 72 * pair, 1e-14);
  EXPECT_NEAR(tail({"A", "B"}).energy, 32 * pair, 1e-14);
  EXPECT_NEAR(tail({"B", "A"}).energy, 32 * pair, 1e-14);
  EXPECT_NEAR(tail({"B", "B"}).energy, 8 * pair, 1e-14);
  const Given screened = {{"amplitude", 1.0}, {"kappa", 1.0}, {"cutoff", 2.0}, {"cut", "switch"s}, {"tail", true}};
  const auto yukawa = [&](bool charges) {
    Given all = screened;
    all.emplace_back("charges", charges);
    return scene.make("yukawa", all)->tail().energy;
  };
  EXPECT_NEAR(yukawa(true) / yukawa(false), 9.0 / 144, 1e-14);  // the sum of the charges is 3
  given.pop_back();
  EXPECT_EQ(scene.make("lennard-jones", given)->tail().energy, 0);
}

TEST(Pairs, SpeciesSelectWhoFeelsATerm) {
  Scene<2> scene(3, 10, Boundary::open, 0.5);
  scene.particles.x = {Vec<2>(0, 0), Vec<2>(1, 0), Vec<2>(0, 1)};
  scene.particles.species = {0, 1, 1};
  scene.particles.charge = {1, 1, 1};
  const Given plain = {{"constant", 1.0}, {"form", "plain"s}};
  auto between = [&](const Names& names) {
    Given given = plain;
    given.emplace_back("species", names);
    return energy(*scene.make("coulomb", given), scene.particles.x);
  };
  EXPECT_DOUBLE_EQ(between({"A", "B"}), 2);
  EXPECT_DOUBLE_EQ(between({"B", "A"}), 2);
  EXPECT_NEAR(between({"B", "B"}), std::sqrt(0.5), 2 * test::kQuantum);
  EXPECT_DOUBLE_EQ(between({"A", "A"}), 0);
}

TEST(Pairs, BondedPairsCanBeLeftOut) {
  const PairList bonds = {{3, 1}, {0, 9}, {3, 4}, {7, 2}};
  const auto table = std::make_shared<const BondTable>(bonds);
  const auto count = [&](const PairList& left_out) {
    return std::ranges::count_if(left_out, [&](const auto& b) { return table->joins(b[0], b[1]); });
  };
  EXPECT_EQ(count({{1, 3}, {3, 1}, {9, 0}, {4, 3}, {2, 7}}), 5);
  EXPECT_EQ(count({{0, 1}, {1, 4}, {9, 10}, {0, 3}, {50, 51}}), 0);

  for (const Boundary boundary : {Boundary::open, Boundary::periodic}) {
    const Scene<3> scene(40, 6, boundary, 0.75);
    const auto& x = scene.particles.x;
    Given given = kLennardJones;
    if (boundary == Boundary::open) given = {{"epsilon", 1.0}, {"sigma", 0.8}};
    const auto all = scene.make("lennard-jones", given);
    given.emplace_back("exclude", "bonded"s);
    const auto some = scene.make("lennard-jones", given, table);
    double expected = energy(*all, x);
    for (const auto& [i, j] : bonds) {
      Scene<3> two(2, 6, boundary, 0.75);
      two.particles.x = {x[i], x[j]};
      expected -= energy(*two.make("lennard-jones", Given(given.begin(), given.end() - 1)), two.particles.x);
    }
    EXPECT_NEAR(energy(*some, x), expected, 1e-12 * test::sums(*all, x).magnitude.value());
  }
}

TEST(Pairs, BondedPairsAreLeftOutAlsoAmongSomeOfTheParticles) {
  Scene<2> scene(5, 10, Boundary::periodic, 0.5);
  for (int i = 0; i < 5; ++i) scene.particles.x[i] = Vec<2>(3 + 0.9 * i, 5);
  Given given = kLennardJones;  // neighbours and next neighbours are within its cutoff
  given.emplace_back("exclude", "bonded"s);
  const auto all = scene.make("lennard-jones", given, std::make_shared<const BondTable>(PairList{{1, 3}, {0, 1}}));
  EXPECT_EQ(all->interacting_pairs(scene.particles.x), 5u);
  Particles<2> some;  // 1, 3 and 4
  for (const Id i : {1u, 3u, 4u}) {
    some.id.push_back(i);
    some.x.push_back(scene.particles.x[i]);
    some.species.push_back(scene.particles.species[i]);
  }
  EXPECT_EQ(all->among(some)->interacting_pairs(some.x), 1u);
}

TEST(Refused, ToLeaveOutBondsThatAreNotThere) {
  const Scene<2> scene(5, 10, Boundary::wall, 0.5);
  expect_contains(refusal(scene, "gravity", {{"constant", 1.0}, {"exclude", "bonded"s}}), "there are no bonds");
}

TEST(Refused, EndsThatCannotBe) {
  const Scene<2> scene(5, 10, Boundary::periodic, 0.5);
  const auto message = [&](Given given) {
    given.insert(given.end(), {{"epsilon", 1.0}, {"sigma", 1.0}, {"exponent", 2.0}});
    return refusal(scene, "inverse-power", given);
  };
  expect_contains(message({{"cutoff", 2.0}, {"cut", "switch"s}, {"switch_from", 2.0}}), "not below the cutoff");
  expect_contains(message({{"cutoff", 2.0}, {"cut", "shifted"s}, {"switch_from", 1.0}}), "belongs to cut = \"switch\"");
  expect_contains(message({{"tail", true}}), "give 'cutoff'");
  expect_contains(message({{"switch_from", 1.0}}), "give 'cutoff'");
  expect_contains(message({{"cutoff", 2.0}, {"cut", "switch"s}, {"tail", true}}), "diverges");
  expect_contains(message({{"cutoff", 2.0}, {"cut", "force-shifted"s}, {"tail", true}}), "take \"switch\"");
  const Scene<2> walls(5, 10, Boundary::wall, 0.5);
  expect_contains(refusal(walls, "lennard-jones", {{"epsilon", 1.0}, {"sigma", 1.0}, {"cutoff", 2.0}, {"tail", true}}),
                  "without borders");
}

TEST(Refused, TablesThatCannotBe) {
  const Scene<2> scene(5, 10, Boundary::wall, 0.5);
  using Numbers = std::vector<double>;
  const auto message = [&](const Numbers& r, const Numbers& v, Given more = {}) {
    more.insert(more.end(), {{"r", r}, {"value", v}});
    return refusal(scene, "table", more);
  };
  expect_contains(refusal(scene, "table", {}), "no points are given");
  expect_contains(message({1, 2, 3}, {1, 2}), "'r' has 3 numbers and 'value' 2");
  expect_contains(message({1}, {1}), "two points at least");
  expect_contains(message({1, 2, 2}, {1, 2, 3}), "do not ascend");
  expect_contains(message({0, 1, 2}, {1, 2, 3}), "not positive");
  expect_contains(message({1, 2, 3}, {3, 2, 0}, {{"cutoff", 4.0}}), "beyond the last point");
  expect_contains(message({1, 2, 3}, {3, 2, 0}, {{"cutoff", 0.5}}), "before the first point");
  expect_contains(message({1, 2, 3}, {3, 2, 0}, {{"slope", Numbers{1}}}), "give two, dV/dr");
}

TEST(Refused, BondsThatCannotBe) {
  const Scene<2> scene(5, 10, Boundary::wall, 0.5);
  const auto message = [&](const PairList& pairs) {
    return refusal(scene, "harmonic-bond", {{"pairs", pairs}, {"stiffness", 1.0}, {"rest_length", 1.0}});
  };
  expect_contains(message({{0, 1}, {3, 5}}), "pair [3, 5] names particle 5, but there are only 5 particles");
  expect_contains(message({{9, 1}}), "names particle 9");
  expect_contains(message({{2, 2}}), "pair [2, 2] bonds a particle to itself");
  expect_contains(message({{0, 1}, {1, 0}}), "pair [0, 1] is given twice");
  const Given spring = {{"stiffness", 1.0}, {"rest_length", 1.0}};
  expect_contains(refusal(scene, "harmonic-bond", spring), "no bonds are given");
  Given both = spring;
  both.emplace_back("pairs", PairList{{0, 1}});
  both.emplace_back("chain", true);
  expect_contains(refusal(scene, "harmonic-bond", both), "give one of them");
  Given length = spring;
  length.emplace_back("chain_length", std::int64_t{2});
  length.emplace_back("within", 3.0);
  expect_contains(refusal(scene, "harmonic-bond", length), "'chain_length' is given without a chain");
  Given apart = spring;
  apart.emplace_back("within", 0.4);
  expect_contains(refusal(scene, "harmonic-bond", apart), "give a larger 'within'");
}

TEST(Refused, UnknownSpecies) {
  const Scene<3> scene(5, 10, Boundary::wall, 0.5);
  const auto message = [&](const Names& names) {
    return refusal(scene, "gravity", {{"constant", 1.0}, {"species", names}});
  };
  expect_contains(message({"A", "C"}), "'C', which is not there; known species: 'A', 'B'");
  expect_contains(message({"A"}), "'species' has 1 entries");
}

TEST(Refused, WhatAPeriodicBoxDoesNotAllow) {
  const Scene<2> scene(5, 10, Boundary::periodic, 0.5);
  expect_contains(refusal(scene, "gravity", {{"constant", 1.0}}), "a periodic box does not allow");
  expect_contains(refusal(scene, "coulomb", {{"constant", 1.0}, {"form", "plain"s}}), "damped-shifted");
  expect_contains(refusal(scene, "lennard-jones", {{"epsilon", 1.0}, {"sigma", 1.0}, {"cut", "switch"s}}),
                  "give 'cutoff'");
  expect_contains(refusal(scene, "harmonic-trap", {{"stiffness", 1.0}}), "periodic");
  expect_contains(refusal(scene, "uniform-field", {{"acceleration", std::vector<double>{0, 1}}}), "axis 1");
}

TEST(Refused, HalfACoulombForm) {
  const Scene<2> scene(5, 10, Boundary::wall, 0.5);
  expect_contains(refusal(scene, "coulomb", {{"constant", 1.0}, {"form", "damped-shifted"s}, {"cutoff", 3.0}}),
                  "needs 'damping' and 'cutoff'");
  expect_contains(refusal(scene, "coulomb", {{"constant", 1.0}, {"form", "plain"s}, {"cutoff", 3.0}}),
                  "belong to form = \"damped-shifted\"");
}

TEST(Refused, VectorsOfTheWrongLength) {
  const Scene<3> scene(5, 10, Boundary::wall, 0.5);
  expect_contains(refusal(scene, "uniform-field", {{"acceleration", std::vector<double>{0, -1}}}),
                  "'acceleration' has 2 components; give 3");
  expect_contains(refusal(scene, "uniform-field", {}), "give 'acceleration' or 'electric_field'");
  expect_contains(
      refusal(scene, "uniform-field",
              {{"acceleration", std::vector<double>{0, 0, -1}}, {"electric_field", std::vector<double>{0, 0, -1}}}),
      "give one of them");
  expect_contains(refusal(scene, "harmonic-trap", {{"stiffness", 1.0}, {"centre", std::vector<double>{1}}}),
                  "'centre' has 1 components; give 3");
}

TEST(Registry, NamesEveryTypeOnceAndDocumentsIt) {
  std::vector<std::string_view> names;
  for (const InteractionInfo& info : interactions()) {
    EXPECT_EQ(std::ranges::count(names, info.name), 0) << info.name;
    names.push_back(info.name);
    EXPECT_FALSE(info.formula.empty() || info.documentation.empty() || info.source.empty()) << info.name;
    for (const Parameter& parameter : info.parameters) EXPECT_FALSE(parameter.meaning.empty()) << parameter.name;
  }
  EXPECT_EQ(names.size(), 11u);
}

TEST(Pairs, ScaleOfAShortRangedAttractionIsThatAtContact) {
  Scene<3> scene(20, 8, Boundary::periodic, 1);
  for (double& radius : scene.particles.radius) radius = 0.5;
  for (const double kappa : {1.0, 7.0, 40.0}) {
    const auto term = scene.make(
        "yukawa",
        {{"amplitude", -std::exp(kappa)}, {"kappa", kappa}, {"charges", false}, {"cutoff", 3.0}, {"cut", "switch"s}});
    const double energy = term->scale(1.5).energy;  // V at contact is -1
    EXPECT_GT(energy, 0.1) << kappa;
    EXPECT_LT(energy, 1) << kappa;
  }
}

TEST(Pairs, ScaleOfAScreenedRepulsionWithoutCoresIsThatAtUsualDistances) {
  Scene<3> scene(20, 8, Boundary::wall, 1);
  for (double& radius : scene.particles.radius) radius = 1e-4;
  const auto term =
      scene.make("yukawa", {{"amplitude", std::exp(10.0)}, {"kappa", 10.0}, {"charges", false}});  // V(1) is 1
  EXPECT_LT(term->scale(1).energy, 16);
  EXPECT_GT(term->scale(1).energy, 0.1);
}

TEST(Pairs, ScaleKnowsTheLargestWeights) {
  Scene<2> scene(6, 8, Boundary::wall, 1);
  scene.particles.mass = {1, 1e-7, 1e-7, 0.5, 1e-7, 1e-7};
  const ForceScale scale = scene.make("gravity", {{"constant", 1.0}})->scale(2);
  EXPECT_NEAR(scale.spread * 1e-14, 1, 1e-12);
  EXPECT_NEAR(scale.force * 64e14, 1, 1e-12);  // 2^-4/r^2
}

}  // namespace
}  // namespace carom::pairs_test
