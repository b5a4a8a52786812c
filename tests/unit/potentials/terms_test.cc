// Every type of interaction in two and three dimensions: its loops must agree with its own energy.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/potentials/scene.h"

namespace carom {
namespace {

using namespace std::string_literals;
using test::displaced;
using test::energy;
using test::forces;
using test::mean_forces;
using test::Scene;

struct Case {
  std::string type;
  Boundary boundary;
  std::vector<std::pair<std::string, ParameterValue>> parameters;
};

const PairList kPeriodicBonds = {{7, 2}, {0, 1}, {3, 5}, {0, 9}};

const std::vector<Case>& cases() {
  using Names = std::vector<std::string>;
  static const std::vector<Case> all = {
      {"harmonic-bond", Boundary::wall, {{"chain", true}, {"stiffness", 1.5}, {"rest_length", 1.2}}},
      {"harmonic-bond", Boundary::periodic, {{"pairs", kPeriodicBonds}, {"stiffness", 1.5}, {"rest_length", 1.2}}},
      {"gravity", Boundary::wall, {{"constant", 0.8}}},
      {"gravity", Boundary::open, {{"constant", 0.8}, {"species", Names{"A", "B"}}}},
      {"coulomb", Boundary::wall, {{"constant", 1.3}, {"form", "plain"s}}},
      {"coulomb",
       Boundary::periodic,
       {{"constant", 1.3}, {"form", "damped-shifted"s}, {"damping", 0.9}, {"cutoff", 2.4}}},
      {"yukawa", Boundary::wall, {{"amplitude", 2.0}, {"kappa", 1.1}, {"charges", true}}},
      {"yukawa",
       Boundary::periodic,
       {{"amplitude", 2.0}, {"kappa", 1.1}, {"charges", false}, {"cutoff", 2.2}, {"cut", "smooth"s}}},
      {"lennard-jones", Boundary::open, {{"epsilon", 1.0}, {"sigma", 0.8}}},
      {"lennard-jones",
       Boundary::periodic,
       {{"epsilon", 1.0}, {"sigma", 0.8}, {"cutoff", 2.0}, {"cut", "smooth"s}, {"species", Names{"B", "B"}}}},
      {"wca", Boundary::periodic, {{"epsilon", 1.0}, {"sigma", 1.1}}},
      {"inverse-power",
       Boundary::periodic,
       {{"epsilon", 1.0}, {"sigma", 0.8}, {"exponent", 9.5}, {"cutoff", 2.0}, {"cut", "smooth"s}}},
      {"uniform-field", Boundary::wall, {}},
      {"harmonic-trap", Boundary::wall, {{"stiffness", 0.7}}},
  };
  return all;
}

template <int D>
class Terms : public ::testing::Test {
 protected:
  static constexpr int kParticles = D == 2 ? 24 : 40;
  static constexpr double kEdge = 5;

  /// Calls check(scene, term) for every case.
  template <class Check>
  void for_each_case(Check check) {
    for (const Case& each : cases()) {
      SCOPED_TRACE(each.type + " in " + std::to_string(D) + " dimensions");
      Scene<D> scene(kParticles, kEdge, each.boundary, 0.75);
      auto parameters = each.parameters;
      if (each.type == "harmonic-bond" &&
          each.boundary == Boundary::periodic)  // shorter than half the box, across edges
        for (const auto& [i, j] : kPeriodicBonds) {
          scene.particles.x[j] = scene.particles.x[i] + Vec<D>::Constant(0.9);
          scene.box.wrap(scene.particles.x[j], scene.particles.image[j]);
        }
      if (each.type == "uniform-field") parameters.emplace_back("acceleration", std::vector<double>(D, -0.6));
      const auto term = scene.make(each.type, parameters);
      check(scene, *term);
    }
  }
};

template <class Dimension>
class InDimension : public Terms<Dimension::value> {};
using Dimensions = ::testing::Types<std::integral_constant<int, 2>, std::integral_constant<int, 3>>;
TYPED_TEST_SUITE(InDimension, Dimensions);

TYPED_TEST(InDimension, ForcesAreMinusTheGradientOfTheEnergy) {
  constexpr int D = TypeParam::value;
  this->for_each_case([](Scene<D>& scene, const Interaction<D>& term) {
    const auto& x = scene.particles.x;
    const auto f = forces(term, x);
    double largest = 0;
    for (const auto& each : f) largest = std::max(largest, each.norm());
    ASSERT_GT(largest, 0.1);
    for (int n = 0; n < 5; ++n) {  // along random directions: four-point differences, error O(h⁴)
      const auto w = scene.random_vectors(1);
      const double h = 1e-3;
      const double slope = (8 * (energy(term, displaced(x, w, h)) - energy(term, displaced(x, w, -h))) -
                            (energy(term, displaced(x, w, 2 * h)) - energy(term, displaced(x, w, -2 * h)))) /
                           (12 * h);
      double expected = 0;
      for (std::size_t i = 0; i < x.size(); ++i) expected -= f[i].dot(w[i]);
      EXPECT_NEAR(slope, expected, 1e-6 * largest * static_cast<double>(x.size()));
    }
  });
}

TYPED_TEST(InDimension, HessianProductsAreTheDerivativeOfTheForces) {
  constexpr int D = TypeParam::value;
  this->for_each_case([](Scene<D>& scene, const Interaction<D>& term) {
    const auto& x = scene.particles.x;
    const auto w = scene.random_vectors(1);
    std::vector<Vec<D>> product(x.size(), Vec<D>::Zero());
    term.add_hessian_product(x, w, product);
    const double h = 1e-5;
    const auto ahead = forces(term, displaced(x, w, h)), behind = forces(term, displaced(x, w, -h));
    double largest = 1;
    for (const auto& each : product) largest = std::max(largest, each.norm());
    for (std::size_t i = 0; i < x.size(); ++i)
      EXPECT_LE((product[i] + (ahead[i] - behind[i]) / (2 * h)).norm(), 3e-6 * largest) << "particle " << i;
  });
}

TYPED_TEST(InDimension, MeanForcesDoExactlyTheWorkOfTheEnergyDifference) {
  constexpr int D = TypeParam::value;
  this->for_each_case([](Scene<D>& scene, const Interaction<D>& term) {
    const auto& x = scene.particles.x;
    for (const double size : {1e-12, 1e-8, 1e-3, 0.1, 0.35}) {
      const auto w = scene.random_vectors(size);
      const auto x_new = displaced(x, w, 1);
      const auto f = mean_forces(term, x, x_new);
      const auto before = test::sums(term, x), after = test::sums(term, x_new);
      ExactSum work;
      double scale = before.magnitude.value() + after.magnitude.value();
      for (std::size_t i = 0; i < x.size(); ++i) {
        const Vec<D> step = x_new[i] - x[i];
        for (int k = 0; k < D; ++k) work.add(f[i][k] * step[k]);
        scale += f[i].norm() * scene.box.edges.norm();  // positions themselves are rounded
      }
      EXPECT_NEAR(work.value(), before.energy.value() - after.energy.value(), 1e-15 * scale) << "step " << size;
    }
  });
}

/// One interval a particle, from x with v and a.
template <int D>
Histories<D> histories(double length, std::span<const Vec<D>> x, std::span<const Vec<D>> v, std::span<const Vec<D>> a) {
  Histories<D> paths;
  paths.reset(length, x, v);
  std::ranges::copy(a, paths.a.begin());
  return paths;
}

template <int D>
void close(Histories<D>& paths) {
  for (Id i = 0; i < paths.particles(); ++i) paths.close(i);
}

/// A slab in which most particles have inner nodes of their own, at random times and with random kinks.
template <int D>
Histories<D> random_histories(Scene<D>& scene, double length) {
  const auto& x = scene.particles.x;
  Histories<D> paths = histories<D>(length, x, scene.random_vectors(0.3), scene.random_vectors(0.3));
  std::uniform_real_distribution<double> uniform(0, 1);
  for (Id i = 0; i < x.size(); ++i)
    for (double t = length * uniform(scene.random); t < 0.6 * length; t += 0.5 * length * uniform(scene.random))
      paths.append(i, t, {}, scene.random_vectors(0.3)[i], scene.random_vectors(0.3)[i]);
  close(paths);
  return paths;
}

template <int D>
std::vector<Vec<D>> impulses(const Interaction<D>& term, const Histories<D>& paths, PairMemory<D>& memory) {
  std::vector<Vec<D>> impulse(paths.intervals(), Vec<D>::Zero());
  term.add_impulses(paths, memory, impulse);
  return impulse;
}

TYPED_TEST(InDimension, ImpulsesKeepTheEnergyAndTheMomentumOnAnyMeshes) {
  constexpr int D = TypeParam::value;
  this->for_each_case([](Scene<D>& scene, const Interaction<D>& term) {
    const auto& x = scene.particles.x;
    const Histories<D> paths = random_histories(scene, 1.0);
    ASSERT_GT(paths.intervals(), x.size() + x.size() / 2);
    term.begin_slab(x, 1.0);
    PairMemory<D> memory;
    const auto impulse = impulses(term, paths, memory);
    auto x_new = x;
    ExactSum work;
    std::array<ExactSum, D> total;
    const auto before = test::sums(term, x);
    double scale = before.magnitude.value(), given = 0;
    for (Id i = 0; i < x.size(); ++i)
      for (std::uint32_t n = i; n != Histories<D>::kNone; n = paths.next[n]) {
        x_new[i] += paths.duration(n) * paths.chord[n];
        work.add(impulse[n].dot(paths.chord[n]));
        for (int k = 0; k < D; ++k) total[k].add(impulse[n][k]);
        given += impulse[n].norm();
      }
    const auto after = test::sums(term, x_new);
    scale += after.magnitude.value() + given * scene.box.edges.norm();
    EXPECT_NEAR(work.value(), before.energy.value() - after.energy.value(), 2e-15 * scale);
    if (!term.keeps_momentum()) return;
    for (int k = 0; k < D; ++k) EXPECT_NEAR(total[k].value(), 0, 1e-15 * given);
  });
}

TYPED_TEST(InDimension, ImpulsesWithoutNodesAreThoseOfTheMeanForces) {
  constexpr int D = TypeParam::value;
  this->for_each_case([](Scene<D>& scene, const Interaction<D>& term) {
    const auto& x = scene.particles.x;
    Histories<D> paths = histories<D>(0.5, x, scene.random_vectors(0.3), std::vector<Vec<D>>(x.size(), Vec<D>::Zero()));
    close(paths);
    term.begin_slab(x, 1.0);
    PairMemory<D> memory;
    const auto impulse = impulses(term, paths, memory);
    const auto f = mean_forces(term, x, displaced(x, paths.v, 0.5));
    for (std::size_t i = 0; i < x.size(); ++i)
      EXPECT_LE((impulse[i] - 0.5 * f[i]).norm(), 1e-13 * (1 + f[i].norm())) << "particle " << i;
  });
}

TYPED_TEST(InDimension, WhatIsRememberedOfPairsIsWhatTheyGive) {
  constexpr int D = TypeParam::value;
  this->for_each_case([](Scene<D>& scene, const Interaction<D>& term) {
    const auto& x = scene.particles.x;
    Histories<D> paths = histories<D>(0.5, x, scene.random_vectors(0.3), std::vector<Vec<D>>(x.size(), Vec<D>::Zero()));
    close(paths);
    term.begin_slab(x, 1.0);
    PairMemory<D> memory;
    impulses(term, paths, memory);
    for (const Id i : {1u, 4u, 5u}) paths.a[i] = Vec<D>::Constant(0.2);
    paths.append(2, 0.2, {}, Vec<D>::Constant(0.1), Vec<D>::Zero());
    close(paths);
    EXPECT_EQ(std::ranges::count(paths.changed, 1), 4);
    const auto again = impulses(term, paths, memory);
    PairMemory<D> fresh;
    const auto expected = impulses(term, paths, fresh);
    for (std::size_t n = 0; n < paths.intervals(); ++n) EXPECT_EQ(again[n], expected[n]) << "interval " << n;
  });
}

TYPED_TEST(InDimension, TrapezoidsGiveAndTakeTheSameAndStartFromNodes) {
  constexpr int D = TypeParam::value;
  this->for_each_case([](Scene<D>& scene, const Interaction<D>& term) {
    const auto& x = scene.particles.x;
    const Histories<D> whole = random_histories(scene, 0.5);
    term.begin_slab(x, 1.0);
    // Build the same histories again, in the order of time, and take what each node receives.
    Histories<D> paths = histories<D>(0.5, x, std::span(whole.v).first(x.size()), std::span(whole.a).first(x.size()));
    std::vector<std::uint32_t> nodes;
    for (Id i = 0; i < x.size(); ++i)
      for (std::uint32_t n = whole.next[i]; n != Histories<D>::kNone; n = whole.next[n]) nodes.push_back(n);
    std::vector<Id> owner(whole.intervals());
    for (Id i = 0; i < x.size(); ++i)
      for (std::uint32_t n = i; n != Histories<D>::kNone; n = whole.next[n]) owner[n] = i;
    std::ranges::sort(nodes, {}, [&](std::uint32_t n) { return whole.start[n]; });
    std::vector<Vec<D>> received(x.size(), Vec<D>::Zero()), correction = received, x_end = x;
    for (const std::uint32_t n : nodes) {
      Vec<D> force = Vec<D>::Zero(), impulse = Vec<D>::Zero();
      const Id i = owner[n];
      term.add_trapezoids(paths, i, whole.start[n], impulse, force);
      received[i] += impulse;
      paths.append(i, whole.start[n], {}, whole.v[n], whole.a[n]);
      auto at_node = x;
      for (Id j = 0; j < x.size(); ++j) at_node[j] = paths.position_in(paths.at(j, whole.start[n]), whole.start[n]);
      const Vec<D> expected = forces(term, at_node)[i];
      EXPECT_LE((force - expected).norm(), 1e-12 * (1 + expected.norm()));
      term.begin_slab(x, 1.0);  // the forces had the list for themselves
    }
    for (Id i = 0; i < x.size(); ++i) {
      if (!paths.simple(i)) term.add_corrections(paths, i, correction);
      x_end[i] = paths.position_in(paths.last[i], paths.length);
    }
    const auto first = forces(term, x), last = forces(term, x_end);
    // The last intervals as a rule of their own, from nodes to the end.
    term.begin_slab(x, 1.0);
    Vec<D> total = Vec<D>::Zero();
    double given = 0;
    for (Id i = 0; i < x.size(); ++i) {
      const Vec<D> by_correction = 0.25 * (first[i] + last[i]) + correction[i];
      Vec<D> force = Vec<D>::Zero(), impulse = Vec<D>::Zero();
      term.add_trapezoids(paths, i, paths.length, impulse, force);
      EXPECT_LE((impulse - by_correction).norm(), 1e-12 * (1 + first[i].norm() + last[i].norm())) << "particle " << i;
      total += received[i] + by_correction;
      given += received[i].norm() + by_correction.norm() + first[i].norm() + last[i].norm();
    }
    if (!term.keeps_momentum()) return;
    EXPECT_LE(total.norm(), 1e-14 * given);
  });
}

TYPED_TEST(InDimension, MeanForcesOfNoStepAreTheForces) {
  constexpr int D = TypeParam::value;
  this->for_each_case([](Scene<D>& scene, const Interaction<D>& term) {
    const auto& x = scene.particles.x;
    const auto f = forces(term, x), mean = mean_forces(term, x, x);
    double largest = 0;
    for (const auto& each : f) largest = std::max(largest, each.norm());
    for (std::size_t i = 0; i < x.size(); ++i) EXPECT_LE((f[i] - mean[i]).norm(), 2e-14 * largest);
  });
}

TYPED_TEST(InDimension, PairForcesCancelInTheirSum) {
  constexpr int D = TypeParam::value;
  this->for_each_case([](Scene<D>& scene, const Interaction<D>& term) {
    if (!term.keeps_momentum()) return;
    const auto& x = scene.particles.x;
    const auto x_new = displaced(x, scene.random_vectors(0.2), 1);
    for (const auto& f : {forces(term, x), mean_forces(term, x, x_new)}) {
      Vec<D> sum = Vec<D>::Zero();
      double scale = 0;
      for (const auto& each : f) {
        sum += each;
        scale += each.norm();
      }
      EXPECT_LE(sum.norm(), 1e-14 * scale);
    }
  });
}

TYPED_TEST(InDimension, WrappingAParticleChangesNothingInAPeriodicBox) {
  constexpr int D = TypeParam::value;
  this->for_each_case([](Scene<D>& scene, const Interaction<D>& term) {
    if (!scene.box.periodic(0)) return;
    const auto& x = scene.particles.x;
    auto carried = x;
    carried[3][0] += scene.box.edges[0];
    carried[5][1] -= scene.box.edges[1];
    const auto before = test::sums(term, x);
    EXPECT_NEAR(energy(term, carried), before.energy.value(), 1e-12 * before.magnitude.value());
    const auto f = forces(term, x), f_carried = forces(term, carried);
    for (std::size_t i = 0; i < x.size(); ++i)
      EXPECT_LE((f[i] - f_carried[i]).norm(), 1e-11 * (1 + f[i].norm())) << "particle " << i;
    // A pair keeps its image during a step: across the edge it is the same step as inside.
    const auto w = scene.random_vectors(0.3);
    const auto mean = mean_forces(term, x, displaced(x, w, 1));
    const auto mean_carried = mean_forces(term, carried, displaced(carried, w, 1));
    for (std::size_t i = 0; i < x.size(); ++i)
      EXPECT_LE((mean[i] - mean_carried[i]).norm(), 1e-10 * (1 + mean[i].norm())) << "particle " << i;
  });
}

TYPED_TEST(InDimension, OnlyTheUniformFieldAcceleratesEverybodyAlike) {
  constexpr int D = TypeParam::value;
  this->for_each_case([](Scene<D>& scene, const Interaction<D>& term) {
    const Vec<D>* acceleration = term.common_acceleration();
    if (acceleration == nullptr) return;
    EXPECT_FALSE(term.keeps_momentum());
    const auto f = forces(term, scene.particles.x);
    for (std::size_t i = 0; i < f.size(); ++i)
      EXPECT_LE((f[i] - scene.particles.mass[i] * *acceleration).norm(), 1e-15);
  });
}

}  // namespace
}  // namespace carom
