// SPDX-License-Identifier: BSD-3-Clause
// Cut potentials: accuracy against 50 digits, also for pairs that cross the cutoff or the start of the switch, and
// continuity there.

#include "engine/forces/potentials/cut.h"

#include <boost/math/special_functions/erf.hpp>

#include "engine/forces/potentials/damped_coulomb.h"
#include "engine/forces/potentials/inverse_power.h"
#include "engine/forces/potentials/lennard_jones.h"
#include "engine/forces/potentials/morse.h"
#include "engine/forces/potentials/tail.h"
#include "engine/forces/potentials/yukawa.h"
#include "tests/unit/potentials/accuracy.h"

namespace carom::cut_test {
namespace {

using test::expect_within;
using test::measure;
using test::Precise;

/// V with its cutoff at ρ_c, in 50 digits, and the sum of its terms' magnitudes.
template <class V>
struct ExactCut {
  V v;
  double cutoff;
  CutKind kind;
  Precise cutoff2 = Precise(cutoff * cutoff);
  Precise level = v(cutoff2);
  Precise first = test::precise_derivative(v, cutoff2), second = test::precise_second_derivative(v, cutoff2);
  Precise slope = kind == CutKind::quadratic ? first : Precise(0);
  Precise curvature = kind == CutKind::quadratic ? second : Precise(0);
  Precise slope_in_r = kind == CutKind::force_shifted ? Precise(2 * Precise(cutoff) * first) : Precise(0);

  Precise value(const Precise& rho) const {
    if (rho >= cutoff2) return 0;
    const Precise z = rho - cutoff2;
    return v(rho) - level - slope * z - curvature / 2 * z * z - slope_in_r * (sqrt(rho) - Precise(cutoff));
  }
  Precise magnitude(const Precise& rho, const Precise& terms) const {
    if (rho >= cutoff2) return terms;
    const Precise z = cutoff2 - rho;
    return terms + abs(slope) * z + abs(curvature) / 2 * z * z + abs(slope_in_r) * abs(sqrt(rho) - Precise(cutoff));
  }
};

Precise lennard_jones(const Precise& rho, int sign) {
  const Precise u = 1 / (rho * rho * rho);
  return 4 * (u * u + sign * u);
}

TEST(Cut, LennardJonesIsAccurateAlsoAcrossTheCutoff) {
  const double cutoff = 2.5;
  for (const CutKind kind : {CutKind::quadratic, CutKind::shifted, CutKind::force_shifted}) {
    const auto v = [](const Precise& rho) { return lennard_jones(rho, -1); };
    const ExactCut<decltype(v)> cut{v, cutoff, kind};
    const auto exact = [&](const Precise& rho) { return cut.value(rho); };
    const auto scale = [&](const Precise& rho) { return cut.magnitude(rho, lennard_jones(rho, 1)); };
    const Cut potential(LennardJones(1, 1), cutoff, kind);
    expect_within(measure(potential, exact, scale, 0.3, cutoff * cutoff * (1 - 1e-10)), 6);
    expect_within(measure(potential, exact, scale, 0.9 * cutoff * cutoff, cutoff * cutoff * (1 - 1e-10)), 6);
  }
}

/// The errors of a switched potential in ε of its terms; `m` is the sum of the magnitudes of the terms of V. Pairs end
/// on both sides of both borders, as near as 1e-16 of the distance between them.
template <Potential P, class V, class M>
void expect_switched(const P& potential, V v, M m, double cutoff, double from, double limit) {
  const Cut cut(potential, cutoff, CutKind::switched, from);
  const Precise start(from * from), end(cutoff * cutoff), width = end - start;
  struct Switch {
    Precise s, first, second, second_terms;
  };
  const auto factor = [&](const Precise& rho) -> Switch {
    if (rho <= start) return {1, 0, 0, 0};
    if (rho >= end) return {0, 0, 0, 0};
    const Precise t = (end - rho) / width, u = (rho - start) / width;
    return {t * t * t * (10 - t * (15 - 6 * t)), -30 * t * t * u * u / width, 60 * t * u * (u - t) / (width * width),
            60 * t * u / (width * width)};
  };
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> uniform(0, 1), digits(-16, 0), steps(-17, 1);
  test::Errors worst;
  const auto take = [](double& largest, double computed, const Precise& exact, const Precise& terms) {
    const double error = test::error_in_epsilons(computed, exact, terms);
    if (!(error <= largest)) largest = error;
  };
  for (int n = 0; n < 6000; ++n) {
    const double border = n % 3 == 1 ? from * from : cutoff * cutoff;
    const double z = std::min(0.5 * border, static_cast<double>(width) * std::pow(10, digits(random)));
    const double b = n % 3 == 0 ? (0.5 + uniform(random)) * border : border + (n % 2 == 0 ? z : -z);
    const double delta = n % 10 == 0 ? 0 : std::pow(10, steps(random));
    const double a = uniform(random) < 0.5 ? b / (1 + delta) : b * (1 + delta);
    const Precise rho(b), lower(std::min(a, b)), upper(std::max(a, b));
    const Switch at = factor(rho);
    const Precise v1 = test::precise_derivative(v, rho), m1 = abs(test::precise_derivative(m, rho));
    const Precise v2 = test::precise_second_derivative(v, rho), m2 = abs(test::precise_second_derivative(m, rho));
    take(worst.value, cut.value(b), v(rho) * at.s, m(rho) * at.s);
    take(worst.derivative, cut.derivative(b), v1 * at.s + v(rho) * at.first, m1 * at.s + m(rho) * abs(at.first));
    take(worst.second_derivative, cut.second_derivative(b), v2 * at.s + 2 * v1 * at.first + v(rho) * at.second,
         m2 * at.s + 2 * m1 * abs(at.first) + m(rho) * at.second_terms);
    const Precise qs = a == b ? at.first : Precise((factor(upper).s - factor(lower).s) / (upper - lower));
    take(worst.quotient, cut.quotient(b, a), v(lower) * qs + factor(upper).s * test::precise_quotient(v, lower, upper),
         m(lower) * abs(qs) + factor(upper).s * abs(test::precise_quotient(m, lower, upper)));
    EXPECT_EQ(cut.quotient(b, a), cut.quotient(a, b)) << b << ", " << a;
  }
  std::printf("    errors in eps: V %.2f, V' %.2f, V'' %.2f, quotient %.2f\n", worst.value, worst.derivative,
              worst.second_derivative, worst.quotient);
  expect_within(worst, limit);
}

TEST(Cut, ASwitchedPotentialIsAccurateOnEverySideOfItsBorders) {
  const auto repulsive = [](const Precise& rho) { return Precise(exp(-sqrt(rho)) / sqrt(rho)); };
  expect_switched(Yukawa(1, 1), repulsive, repulsive, 3.0, 2.7, 12);
  const auto terms = [](const Precise& rho) { return lennard_jones(rho, 1); };
  const auto attractive = [](const Precise& rho) { return lennard_jones(rho, -1); };
  expect_switched(LennardJones(1, 1), attractive, terms, 2.5, 2.25, 12);
  expect_switched(LennardJones(1, 1), attractive, terms, 2.5, 2.49, 12);
  expect_switched(LennardJones(1, 1), attractive, terms, 3.0, 1.5, 12);
}

TEST(Cut, ASwitchedPotentialIsItselfUpToTheSwitch) {
  const Cut cut(LennardJones(1, 1), 2.5, CutKind::switched, 2.25);
  const LennardJones whole(1, 1);
  for (const double rho : {0.8, 1.3, 4.0, 2.25 * 2.25}) {
    EXPECT_EQ(cut.value(rho), whole.value(rho));
    EXPECT_EQ(cut.derivative(rho), whole.derivative(rho));
    EXPECT_EQ(cut.second_derivative(rho), whole.second_derivative(rho));
    EXPECT_EQ(cut.quotient(rho, 0.9), whole.quotient(0.9, rho));
  }
}

TEST(Cut, LanesGetTheBitsOfDoubles) {
  using Two = double __attribute__((vector_size(16)));
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(0.8, 8.0), step(-0.3, 0.3);
  for (const CutKind kind : {CutKind::switched, CutKind::shifted, CutKind::force_shifted, CutKind::quadratic}) {
    const Cut cut(LennardJones(1, 1), 2.5, kind, 2.25);
    for (int n = 0; n < 500; ++n) {
      Two b, a;
      for (int l = 0; l < 2; ++l) b[l] = uniform(random), a[l] = b[l] + (l == 0 ? 0 : step(random));
      Two lanes[4];
      lanes[0] = cut.value(b), lanes[1] = cut.derivative(b), lanes[2] = cut.second_derivative(b);
      lanes[3] = cut.quotient(b, a);
      for (int l = 0; l < 2; ++l) {
        EXPECT_EQ(lanes[0][l], cut.value(b[l]));
        EXPECT_EQ(lanes[1][l], cut.derivative(b[l]));
        EXPECT_EQ(lanes[2][l], cut.second_derivative(b[l]));
        EXPECT_EQ(lanes[3][l], cut.quotient(b[l], a[l]));
      }
    }
  }
}

TEST(Cut, DampedShiftedCoulombIsAccurateAlsoAcrossTheCutoff) {
  const double cutoff = 3, alpha = 0.7;
  const auto v = [&](const Precise& rho) {
    const Precise r = sqrt(rho);
    return Precise(boost::math::erfc(Precise(alpha) * r) / r);
  };
  const ExactCut<decltype(v)> cut{v, cutoff, CutKind::quadratic};
  const auto exact = [&](const Precise& rho) { return cut.value(rho); };
  const auto scale = [&](const Precise& rho) { return cut.magnitude(rho, v(rho)); };
  const auto rounding = [&](double rho, double) { return 1 + alpha * alpha * rho; };
  const Cut potential(DampedCoulomb(1, alpha), cutoff, CutKind::quadratic);
  expect_within(measure(potential, exact, scale, 0.01, cutoff * cutoff * (1 - 1e-10), rounding, 400), 4);
}

TEST(Cut, IsTwiceContinuouslyDifferentiableAtTheCutoff) {
  const double cutoff = 2.5, rho_c = cutoff * cutoff;
  const Yukawa whole(1.5, 1.2);
  for (const CutKind kind : {CutKind::quadratic, CutKind::switched}) {
    const Cut potential(whole, cutoff, kind, 0.9 * cutoff);
    double last = 1;
    for (const double step : {1e-3, 1e-5, 1e-7}) {  // V, V′, V″ decrease with the third, second and first power
      const double z = step * rho_c, inside = rho_c - z;
      const double v = 2000 * whole.value(rho_c);  // the switch: 10 t³, t = z/0.19 ρ_c
      EXPECT_LE(std::abs(potential.value(inside)), v * step * step * step + 1e-17);
      EXPECT_LE(std::abs(potential.derivative(inside)), 3 * v / rho_c * step * step + 1e-17);
      EXPECT_LE(std::abs(potential.second_derivative(inside)), 6 * v / (rho_c * rho_c) * step + 1e-16);
      EXPECT_LT(std::abs(potential.second_derivative(inside)), last);
      last = std::abs(potential.second_derivative(inside));
    }
  }
}

TEST(Cut, EveryKindIsZeroFromTheCutoffOutwards) {
  const double rho_c = 6.25;
  for (const CutKind kind : {CutKind::quadratic, CutKind::switched, CutKind::shifted, CutKind::force_shifted}) {
    const Cut potential(Yukawa(1.5, 1.2), 2.5, kind, 2.0);
    for (const double rho : {rho_c, 1.5 * rho_c}) {
      EXPECT_EQ(potential.value(rho), 0);
      EXPECT_EQ(potential.derivative(rho), 0);
      EXPECT_EQ(potential.second_derivative(rho), 0);
      EXPECT_EQ(potential.quotient(rho, 2 * rho), 0);
      EXPECT_EQ(potential.quotient(rho, rho), 0);
    }
  }
}

TEST(Cut, ShiftedKeepsTheForceOfTheWholePotential) {
  const Cut potential(LennardJones(1, 1), 2.5, CutKind::shifted);
  EXPECT_EQ(potential.derivative(3.0), LennardJones(1, 1).derivative(3.0));
  EXPECT_NEAR(potential.value(6.25 * (1 - 1e-12)), 0, 1e-12);
  EXPECT_EQ(potential.derivative(6.25), 0);
}

TEST(Cut, ForceShiftedTakesTheSameForceOffAtAllDistances) {
  const LennardJones whole(1, 1);
  const Cut potential(whole, 2.5, CutKind::force_shifted);
  const double at_end = 5.0 * whole.derivative(6.25);  // dV/dr
  for (const double r : {0.95, 1.4, 2.4})
    EXPECT_NEAR(2 * r * potential.derivative(r * r), 2 * r * whole.derivative(r * r) - at_end, 1e-14);
  EXPECT_NEAR(potential.derivative(6.25 * (1 - 1e-12)), 0, 1e-12);
}

/// ∫_a^∞ f by the trapezoidal rule in s, r = a + e^(s − e^(−s)).
template <class F>
double to_infinity(double a, F f) {
  double sum = 0;
  const double h = 1.0 / 128;
  for (double s = -5; s < 60; s += h) {
    const double e = std::exp(-s), x = std::exp(s - e);
    sum += h * f(a + x) * x * (1 + e);
  }
  return sum;
}

template <int D, class P>
void expect_tail(const P& whole) {
  const double area = (D == 3 ? 4 : 2) * std::numbers::pi, pairs = 500, volume = 20;
  for (const CutKind kind : {CutKind::switched, CutKind::shifted}) {
    const Cut cut(whole, 2.5, kind, 2.2);
    const bool switched = kind == CutKind::switched;
    const auto lost = [&](double r) { return whole.value(r * r) - (switched ? cut.value(r * r) : 0); };
    const auto lost_force = [&](double r) {
      return -2 * r * (whole.derivative(r * r) - (switched ? cut.derivative(r * r) : 0));
    };
    const double start = switched ? 2.2 : 2.5;
    const double energy = to_infinity(start, [&](double r) { return lost(r) * std::pow(r, D - 1); });
    const double virial = to_infinity(start, [&](double r) { return lost_force(r) * std::pow(r, D); });
    const Tail tail = tail_correction<D>(cut, pairs, volume);
    EXPECT_NEAR(tail.energy, area * pairs / volume * energy, 1e-5 * std::abs(tail.energy));
    EXPECT_NEAR(tail.virial, area * pairs / volume * virial, 1e-5 * std::abs(tail.virial));
  }
}

TEST(TailCorrection, IsTheIntegralOfWhatTheCutTakesAway) {
  expect_tail<2>(LennardJones(1.3, 0.9));
  expect_tail<3>(LennardJones(1.3, 0.9));
  expect_tail<2>(Yukawa(-2, 0.8));
  expect_tail<3>(Yukawa(-2, 0.8));
  expect_tail<2>(Morse(1.3, 2.1, 1.2));
  expect_tail<3>(Morse(1.3, 2.1, 1.2));
  expect_tail<2>(InversePower(0.7, 1.1, 5.5));
  expect_tail<3>(InversePower(0.7, 1.1, 5.5));
}

TEST(TailCorrection, OfTruncatedLennardJonesIsTheTextbooks) {  // Allen, Tildesley, 2nd ed., eqs 2.144 and 2.145
  const double n = 500, density = 0.776, end = 3, pi = std::numbers::pi;
  const Tail tail = tail_correction<3>(Cut(LennardJones(1, 1), end, CutKind::shifted), n * n / 2, n / density);
  EXPECT_NEAR(tail.energy / n, 8 * pi * density * (std::pow(end, -9) / 9 - std::pow(end, -3) / 3), 1e-14);
  EXPECT_NEAR(tail.virial / (3 * n / density),
              32 * pi * density * density * (std::pow(end, -9) / 9 - std::pow(end, -3) / 6), 1e-13);
}

}  // namespace
}  // namespace carom::cut_test
