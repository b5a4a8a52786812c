// SPDX-License-Identifier: BSD-3-Clause
// Every type of interaction in two and three dimensions: its forces must agree with its energy.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/potentials/cases.h"

namespace carom {
namespace {

using test::displaced;
using test::energy;
using test::forces;
using test::mean_forces;
using test::Scene;

template <int D>
class Terms : public ::testing::Test {
 protected:
  template <class Check>
  void for_each_case(Check check) {
    test::for_each_case<D>(check);
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

TYPED_TEST(InDimension, TheVirialIsMinusTheDerivativeOfTheEnergyByTheScaleOfTheBox) {
  constexpr int D = TypeParam::value;
  this->for_each_case([](Scene<D>& scene, const Interaction<D>& term, auto&& remake) {
    if (!term.keeps_momentum()) return;  // fields do not conserve it
    const auto scaled_energy = [&](double scale) {
      Scene<D> scaled = scene;
      scaled.box.edges *= scale;
      for (auto& x : scaled.particles.x) x *= scale;
      return energy(*remake(scaled), scaled.particles.x);
    };
    const auto at = test::sums(term, scene.particles.x);
    const double h = 1e-4;
    const double slope =
        (8 * (scaled_energy(1 + h) - scaled_energy(1 - h)) - (scaled_energy(1 + 2 * h) - scaled_energy(1 - 2 * h))) /
        (12 * h);
    EXPECT_NEAR(at.virial.value(), -slope, 1e-6 * (std::abs(slope) + at.magnitude.value()));
    EXPECT_GT(std::abs(slope), 1e-3 * at.magnitude.value());
  });
}

TYPED_TEST(InDimension, HessianProductsAreTheDerivativeOfTheForces) {
  constexpr int D = TypeParam::value;
  this->for_each_case([](Scene<D>& scene, const Interaction<D>& term) {
    const auto& x = scene.particles.x;
    const auto w = scene.random_vectors(1);
    ForceSums<D> sums(x.size(), test::kQuantum);
    term.add_hessian_product(x, w, sums);
    const std::vector<Vec<D>> product = test::values(sums);
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
    // A pair keeps its image during a step: a step across the edge is equal to one inside.
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
