// SPDX-License-Identifier: BSD-3-Clause
// Every type of interaction in two and three dimensions: its forces must agree with its energy.

#include <gtest/gtest.h>

#include <cmath>

#include "engine/forces/forces.h"
#include "tests/support/experiments.h"
#include "tests/unit/potentials/cases.h"

namespace carom::terms_test {
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

/// Sums over a lattice of images, a particle's own among them, by loops over all images within the cutoff. The energy
/// and the force of a pair are those of two particles alone in an open box.
template <int D>
struct LatticeSums {
  double energy = 0, magnitude = 0;
  Eigen::Matrix<double, D, D> stress = Eigen::Matrix<double, D, D>::Zero();
  Vec<D> heat = Vec<D>::Zero();

  LatticeSums(const Scene<D>& scene, const test::Case& law, double cutoff, const BondTable* excluded,
              const std::vector<Vec<D>>& v) {
    const auto& p = scene.particles;
    Image<D> last{};
    for (int k = 0; k < D; ++k)
      if (scene.box.periodic(k)) last[k] = static_cast<int>(cutoff / scene.box.edges[k]) + 2;
    for (Id i = 0; i < p.size(); ++i)
      for (Id j = 0; j < p.size(); ++j) {
        if (excluded && i != j && excluded->joins(i, j)) continue;
        Scene<D> two(0, 100, Boundary::open, 0);
        for (const Id one : {i, j}) {
          two.particles.x.push_back(Vec<D>::Zero());
          two.particles.mass.push_back(p.mass[one]);
          two.particles.charge.push_back(p.charge[one]);
          two.particles.species.push_back(p.species[one]);
          two.particles.image.push_back({});
          two.particles.radius.push_back(0.1);
        }
        const auto term = two.make(law.type, law.parameters);
        const auto add = [&](const Vec<D>& d) {
          if (d.norm() == 0) return;
          const auto pair = test::sums<D>(*term, {d, Vec<D>::Zero()});
          const Vec<D> force = pair.virial.value() / d.squaredNorm() * d;
          energy += 0.5 * pair.energy.value();
          magnitude += 0.5 * pair.magnitude.value();
          stress += 0.5 * d * force.transpose();
          heat += 0.5 * (pair.energy.value() * v[i] + force.dot(v[i]) * d);
        };
        for (int a = -last[0]; a <= last[0]; ++a)
          for (int b = -last[1]; b <= last[1]; ++b)
            for (int c = D == 3 ? -last[D - 1] : 0; c <= (D == 3 ? last[D - 1] : 0); ++c) {
              Vec<D> d = p.x[i] - p.x[j];
              d[0] += a * scene.box.edges[0], d[1] += b * scene.box.edges[1];
              if constexpr (D == 3) d[2] += c * scene.box.edges[2];
              add(d);
            }
      }
  }
};

/// All edges are shorter than the cutoff, or all but one, which is walled.
TYPED_TEST(InDimension, SumsInABoxShorterThanTheCutoffAreThoseOfALattice) {
  constexpr int D = TypeParam::value;
  using namespace std::string_literals;
  std::vector<test::Case> laws = test::cases();
  const auto ewald = std::pair{"form"s, ParameterValue("ewald"s)};
  std::erase_if(laws, [&](const test::Case& law) {
    return law.boundary != Boundary::periodic || law.type == "harmonic-bond" ||
           std::ranges::find(law.parameters, ewald) != law.parameters.end();
  });
  EXPECT_EQ(laws.size(), 7u);
  laws.push_back({"lennard-jones",
                  Boundary::periodic,
                  {{"epsilon", 1.0}, {"sigma", 0.5}, {"cutoff", 2.9}, {"cut", "shifted"s}, {"exclude", "bonded"s}}});
  laws.push_back({"yukawa",
                  Boundary::periodic,
                  {{"amplitude", 2.0},
                   {"kappa", 1.1},
                   {"charges", true},
                   {"cutoff", 2.2},
                   {"cut", "force-shifted"s},
                   {"species", std::vector<std::string>{"A", "B"}}}});
  for (const test::Case& given : laws) {
    const auto& parameters = given.parameters;
    test::Case law = given;
    const bool excludes = parameters.back().first == "exclude";
    if (excludes) law.parameters.pop_back();
    for (const bool walled : {false, true}) {
      SCOPED_TRACE(given.type + (walled ? ", walled" : ""));
      Scene<D> scene(10, 1.6, Boundary::periodic, 0.35);
      scene.box.edges[0] = 2.1, scene.box.edges[1] = 1.75;
      if (walled) scene.box.boundary[D - 1] = Boundary::wall, scene.box.edges[D - 1] = 4;
      const auto bonds = excludes ? std::make_shared<BondTable>(test::kPeriodicBonds) : nullptr;
      const auto v = scene.random_vectors(1);
      const auto remake = [&](const Scene<D>& of) { return of.make(given.type, parameters, bonds); };
      const auto term = remake(scene);
      const LatticeSums<D> expected(scene, law, 2.9, bonds.get(), v);
      const auto found = test::sums(*term, scene.particles.x);
      const double scale = 1e-13 * expected.magnitude;
      EXPECT_NEAR(found.energy.value(), expected.energy, scale);
      EXPECT_NEAR(found.magnitude.value(), expected.magnitude, scale);
      const double stress_scale = 1e-12 * (expected.magnitude + expected.stress.norm());
      EXPECT_NEAR(found.virial.value(), expected.stress.trace(), stress_scale);
      PairFluxes<D> fluxes;
      term->add_fluxes(scene.particles.x, v, fluxes);
      for (int a = 0; a < D; ++a) {
        for (int b = 0; b < D; ++b)
          EXPECT_NEAR(fluxes.stress[D * a + b].value(), expected.stress(a, b), stress_scale) << a << b;
        EXPECT_NEAR(fluxes.heat[a].value(), expected.heat[a], 3 * stress_scale) << a;
        // The stress is minus the derivative of the energy by the logarithm of an edge.
        if (!scene.box.periodic(a)) continue;
        const auto energy_at = [&](double factor) {
          Scene<D> stretched = scene;
          stretched.box.edges[a] *= factor;
          for (auto& x : stretched.particles.x) x[a] *= factor;
          return energy(*remake(stretched), stretched.particles.x);
        };
        const double h = 1e-4;
        const double slope =
            (8 * (energy_at(1 + h) - energy_at(1 - h)) - (energy_at(1 + 2 * h) - energy_at(1 - 2 * h))) / (12 * h);
        EXPECT_NEAR(fluxes.stress[(D + 1) * a].value(), -slope, 1e-6 * (std::abs(slope) + expected.magnitude)) << a;
      }
    }
  }
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

/// Changes fill the sums after some hundred of them. The renewal does not count, because it depends on the lists.
TEST(MeanForces, CountTheSamePairsHoweverManyChangesThereHaveBeen) {
  const auto system = test::hard_spheres<3>(4, 0.3);
  test::add_interaction(*system, "lennard-jones", {{"epsilon", 1.0}, {"sigma", 1.0}, {"cutoff", 2.5}});
  const auto& x = system->particles.x;
  MeanForces<3> forces;
  forces.evaluate(*system, x, x);
  std::vector<char> changed(x.size(), 0);
  changed[0] = 1;
  auto near = x, far = x;
  far[0][0] += 0.3;
  const std::uint64_t pairs = forces.update(*system, x, near, far, changed.data());
  for (int k = 0; k < 1000; ++k) {
    ASSERT_EQ(forces.update(*system, x, far, near, changed.data()), pairs) << k;
    ASSERT_EQ(forces.update(*system, x, near, far, changed.data()), pairs) << k;
  }
  MeanForces<3> afresh;
  afresh.evaluate(*system, x, far);
  for (Id i = 0; i < x.size(); ++i) EXPECT_EQ(forces[i], afresh[i]);
}

}  // namespace
}  // namespace carom::terms_test
