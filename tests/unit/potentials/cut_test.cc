// Cut potentials: accuracy against 50 digits, also for pairs that cross the cutoff, and continuity at the cutoff.

#include "engine/potentials/cut.h"

#include <boost/math/special_functions/erf.hpp>

#include "engine/potentials/damped_coulomb.h"
#include "engine/potentials/lennard_jones.h"
#include "engine/potentials/yukawa.h"
#include "tests/unit/potentials/accuracy.h"

namespace carom {
namespace {

using test::expect_within;
using test::measure;
using test::Precise;

/// V made to end at ρ_c, in 50 digits; and the sum of its terms' magnitudes, for V monotonic and convex.
template <class V>
struct ExactCut {
  V v;
  Precise cutoff2;
  CutKind kind;
  Precise level = v(cutoff2);
  Precise slope = kind == CutKind::smooth ? test::precise_derivative(v, cutoff2) : Precise(0);
  Precise curvature = kind == CutKind::smooth ? test::precise_second_derivative(v, cutoff2) : Precise(0);

  Precise value(const Precise& rho) const {
    if (rho >= cutoff2) return 0;
    const Precise z = rho - cutoff2;
    return v(rho) - level - slope * z - curvature / 2 * z * z;
  }
  Precise magnitude(const Precise& rho, const Precise& terms) const {
    const Precise z = abs(rho - cutoff2);
    return terms + abs(slope) * z + abs(curvature) / 2 * z * z;
  }
};

Precise lennard_jones(const Precise& rho, int sign) {
  const Precise u = 1 / (rho * rho * rho);
  return 4 * (u * u + sign * u);
}

TEST(Cut, LennardJonesIsAccurateAlsoAcrossTheCutoff) {
  const double cutoff = 2.5;
  for (const CutKind kind : {CutKind::smooth, CutKind::shifted}) {
    const auto v = [](const Precise& rho) { return lennard_jones(rho, -1); };
    const ExactCut<decltype(v)> cut{v, Precise(cutoff * cutoff), kind};
    const auto exact = [&](const Precise& rho) { return cut.value(rho); };
    const auto scale = [&](const Precise& rho) { return cut.magnitude(rho, lennard_jones(rho, 1)); };
    const Cut potential(LennardJones(1, 1), cutoff, kind);
    expect_within(measure(potential, exact, scale, 0.3, cutoff * cutoff * (1 - 1e-10)), 6);
    expect_within(measure(potential, exact, scale, 0.9 * cutoff * cutoff, cutoff * cutoff * (1 - 1e-10)), 6);
  }
}

TEST(Cut, DampedShiftedCoulombIsAccurateAlsoAcrossTheCutoff) {
  const double cutoff = 3, alpha = 0.7;
  const auto v = [&](const Precise& rho) {
    const Precise r = sqrt(rho);
    return Precise(boost::math::erfc(Precise(alpha) * r) / r);
  };
  const ExactCut<decltype(v)> cut{v, Precise(cutoff * cutoff), CutKind::smooth};
  const auto exact = [&](const Precise& rho) { return cut.value(rho); };
  const auto scale = [&](const Precise& rho) { return cut.magnitude(rho, v(rho)); };
  const auto rounding = [&](double rho, double) { return 1 + alpha * alpha * rho; };
  const Cut potential(DampedCoulomb(1, alpha), cutoff, CutKind::smooth);
  expect_within(measure(potential, exact, scale, 0.01, cutoff * cutoff * (1 - 1e-10), rounding, 400), 4);
}

TEST(Cut, IsTwiceContinuouslyDifferentiableAtTheCutoff) {
  const double cutoff = 2.5, rho_c = cutoff * cutoff;
  const Cut potential(Yukawa(1.5, 1.2), cutoff, CutKind::smooth);
  const Yukawa whole(1.5, 1.2);
  double last = 1;
  for (const double step : {1e-2, 1e-4, 1e-6, 1e-8}) {  // V, V′, V″ fall as the third, second and first power
    const double z = step * rho_c, inside = rho_c - z;
    EXPECT_LE(std::abs(potential.value(inside)), 100 * whole.value(rho_c) * step * step * step + 1e-23);
    EXPECT_LE(std::abs(potential.derivative(inside)), 100 * std::abs(whole.derivative(rho_c)) * step * step + 1e-17);
    EXPECT_LE(std::abs(potential.second_derivative(inside)), 100 * whole.second_derivative(rho_c) * step + 1e-16);
    EXPECT_LT(std::abs(potential.second_derivative(inside)), last);
    last = std::abs(potential.second_derivative(inside));
  }
  for (const double rho : {rho_c, 1.5 * rho_c}) {
    EXPECT_EQ(potential.value(rho), 0);
    EXPECT_EQ(potential.derivative(rho), 0);
    EXPECT_EQ(potential.second_derivative(rho), 0);
    EXPECT_EQ(potential.quotient(rho, 2 * rho), 0);
  }
}

TEST(Cut, ShiftedKeepsTheForceOfTheWholePotential) {
  const Cut potential(LennardJones(1, 1), 2.5, CutKind::shifted);
  EXPECT_EQ(potential.derivative(3.0), LennardJones(1, 1).derivative(3.0));
  EXPECT_NEAR(potential.value(6.25 * (1 - 1e-12)), 0, 1e-12);
  EXPECT_EQ(potential.derivative(6.25), 0);
}

}  // namespace
}  // namespace carom
