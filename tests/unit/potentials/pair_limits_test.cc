// SPDX-License-Identifier: BSD-3-Clause
// Sums over pairs at the limits of their range: an overflow is refused with an error that names the pair.

#include "engine/base/error.h"
#include "engine/forces/potentials/inverse_distance.h"
#include "tests/unit/potentials/plain_sums.h"

namespace carom::pair_limits_test {
namespace {

using test::cut_lennard_jones;
using test::kQuantum;
using test::Scene;

/// The message of the Error(Failure::numerical) that these forces throw.
template <int D>
std::string refusal(const Interaction<D>& term, const std::vector<Vec<D>>& x) {
  ForceSums<D> forces(x.size(), kQuantum);
  try {
    term.add_forces(x, forces);
  } catch (const Error& error) {
    EXPECT_EQ(error.failure(), Failure::numerical);
    return error.what();
  }
  return "none";
}

TEST(PairSums, NameThePairWhoseForceIsNoNumber) {
  Scene<3> scene(30, 8, Boundary::wall, 1);
  auto& x = scene.particles.x;
  x[17] = x[5];
  const std::string gravity = refusal(*scene.make("gravity", {{"constant", 1.0}}), x);
  EXPECT_NE(gravity.find("between particles 5 and 17"), std::string::npos) << gravity;
  const std::string fluid = refusal(*scene.make("lennard-jones", cut_lennard_jones(0.8, 2.0)), x);
  EXPECT_NE(fluid.find("between particles 5 and 17"), std::string::npos) << fluid;
  ForceSums<3> mean(x.size(), kQuantum);  // for a trial step
  scene.make("gravity", {{"constant", 1.0}})->add_mean_forces(x, x, mean);
  EXPECT_TRUE(std::isnan(mean.value(0)[0]));
  x[3][1] = std::numeric_limits<double>::quiet_NaN();
  const std::string lost = refusal(*scene.make("gravity", {{"constant", 1.0}}), x);
  EXPECT_NE(lost.find("the position of particle 3 is not finite"), std::string::npos) << lost;
}

TEST(PairSums, NameBondsAndStraysByTheIdsOfTheParticles) {
  Scene<2> scene(12, 8, Boundary::periodic, 0.5);
  scene.particles.x[4] = Vec<2>(1, 1), scene.particles.x[9] = Vec<2>(4.9, 1);
  Particles<2> some;
  for (const Id i : {4, 7, 9}) {
    some.x.push_back(scene.particles.x[i]);
    some.mass.push_back(1);
    some.species.push_back(0);
    some.id.push_back(i);
  }
  const auto bond =
      scene.make("harmonic-bond", {{"pairs", PairList{{4, 9}}}, {"stiffness", 1.0}, {"rest_length", 1.0}})->among(some);
  EXPECT_NE(refusal(*bond, some.x).find("the bond of particles 4 and 9 "), std::string::npos);
  const auto fluid = scene.make("lennard-jones", cut_lennard_jones(0.8, 2.0))->among(some);
  auto x_new = some.x;
  x_new[1][0] += 40;
  ForceSums<2> mean(3, kQuantum);
  try {
    fluid->add_mean_forces(some.x, x_new, mean);
    ADD_FAILURE() << "no error";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("particle 7 moves farther than"), std::string::npos) << error.what();
  }
  some.x[1][0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(refusal(*fluid, some.x).find("position of particle 7 is"), std::string::npos);
}

TEST(PairSums, HoldForcesOfAllMagnitudesOrSaySo) {
  Scene<3> scene(24, 6, Boundary::wall, 0.5);
  std::uniform_real_distribution<double> exponent(-9, 0), part(-1, 1);
  int held = 0, refused = 0;
  for (int round = 0; round < 300; ++round) {
    auto x = scene.particles.x;
    for (int n = 0; n < 3; ++n) {  // some approach each other closely
      const auto i = scene.random() % x.size(), j = scene.random() % x.size();
      x[i] = x[j] + std::pow(10, exponent(scene.random)) * Vec<3>(part(scene.random), part(scene.random), 1);
    }
    for (double& q : scene.particles.charge) q = part(scene.random) * std::pow(10, 0.5 * exponent(scene.random));
    const InverseDistance potential(1.0);
    const auto term = scene.make("coulomb", {{"constant", 1.0}, {"form", std::string("plain")}});
    if (refusal(*term, x) != "none") {
      ++refused;
      continue;
    }
    ++held;
    constexpr double kAll = std::numeric_limits<double>::infinity();
    test::expect_reference(scene, *term, potential, kAll, &scene.particles.charge, x, x);
  }
  EXPECT_GT(held, 100);
  EXPECT_GT(refused, 10);
}

TEST(ForceSums, CarryWhereManyPassesAddUp) {
  ForceSums<2> sums(2, 1.0);
  const ForceLimits limits = sums.make_room(1);
  const Vec<2> large(limits.low - 1, -3e15);
  for (int n = 1; n < 20000; ++n) {
    sums.make_room(1);
    ASSERT_TRUE(sums.add(1, large, limits));
  }
  EXPECT_TRUE(sums.quanta(1)[0] == static_cast<ForceSums<2>::Whole>(limits.low - 1) * 19999);
  EXPECT_TRUE(sums.quanta(1)[1] == static_cast<ForceSums<2>::Whole>(-3e15) * 19999);
  EXPECT_EQ(sums.value(0), Vec<2>(0, 0));
}

TEST(ForceSums, DoNotWrapWhereManyTermsHaveManyPartners) {
  constexpr std::size_t kPartners = 1 << 16;
  ForceSums<2> sums(1, 1.0);
  ForceSums<2>::Whole expected = 0;
  for (int term = 0; term < 12; ++term) {
    const ForceLimits limits = sums.make_room(kPartners);
    ASSERT_GE(limits.high, 0x1p30);
    const double upper = std::nextafter(limits.high, 0) - 1, large = 0x1p40 * std::floor(upper);
    for (std::size_t n = 0; n < kPartners; ++n) ASSERT_TRUE(sums.add(0, Vec<2>(large, 0), limits));
    expected += static_cast<ForceSums<2>::Whole>(large) * kPartners;
    ASSERT_TRUE(sums.quanta(0)[0] == expected) << term;
  }
}

}  // namespace
}  // namespace carom::pair_limits_test
