// SPDX-License-Identifier: BSD-3-Clause
// Potentials given by points: the spline against 50 digits, its continuity, pairs that cross knots, and both ends.

#include "engine/forces/potentials/table.h"

#include "engine/forces/potentials/cut.h"
#include "engine/forces/potentials/lennard_jones.h"
#include "tests/unit/potentials/accuracy.h"

namespace carom::table_test {
namespace {

using test::Precise;

struct Points {
  std::vector<double> r, v;
};

/// Points of Lennard-Jones at equal distances in r.
Points lennard_jones_points(int count, double from = 0.8, double to = 3) {
  Points p;
  for (int k = 0; k < count; ++k) {
    p.r.push_back(from + (to - from) * k / (count - 1));
    p.v.push_back(LennardJones(1, 1).value(p.r.back() * p.r.back()));
  }
  return p;
}

std::vector<double> lennard_jones_slopes(const Points& p) {
  std::vector<double> slopes;
  for (const double r : {p.r.front(), p.r.back()}) slopes.push_back(2 * r * LennardJones(1, 1).derivative(r * r));
  return slopes;
}

TEST(Table, GoesThroughItsPointsAndHasTheGivenSlopes) {
  const Points p = lennard_jones_points(20);
  const Table table(p.r, p.v, std::vector{-1.5, 0.25});
  for (std::size_t k = 0; k < p.r.size(); ++k)
    EXPECT_NEAR(table.value(p.r[k] * p.r[k]), p.v[k], 1e-14 * (1 + std::abs(p.v[k])));
  EXPECT_NEAR(2 * p.r.front() * table.derivative(p.r.front() * p.r.front()), -1.5, 1e-14);
  EXPECT_NEAR(2 * p.r.back() * table.derivative(p.r.back() * p.r.back()), 0.25, 1e-13);
}

TEST(Table, ANaturalSplineHasNoSecondDerivativeAtItsEnds) {
  const Points p = lennard_jones_points(20);
  const Table table(p.r, p.v, {});
  EXPECT_NEAR(table.second_derivative(p.r.front() * p.r.front()), 0, 1e-9);
  EXPECT_NEAR(table.second_derivative(p.r.back() * p.r.back()), 0, 1e-9);
}

TEST(Table, IsTwiceContinuouslyDifferentiableAlsoBelowItsFirstPoint) {
  const Points p = lennard_jones_points(40);
  const Table table(p.r, p.v, lennard_jones_slopes(p));
  for (std::size_t k = 0; k + 1 < p.r.size(); ++k) {
    const double rho = p.r[k] * p.r[k], before = rho * (1 - 1e-13), after = rho * (1 + 1e-13);
    EXPECT_NEAR(table.value(before), table.value(after), 1e-10 * std::abs(table.value(0.64)));
    EXPECT_NEAR(table.derivative(before), table.derivative(after), 1e-10 * std::abs(table.derivative(0.64)));
    EXPECT_NEAR(table.second_derivative(before), table.second_derivative(after),
                1e-10 * std::abs(table.second_derivative(0.64)));
  }
}

TEST(Table, ConvergesToThePotentialItSamples) {
  double last = 1;
  for (const int count : {100, 200, 400}) {
    const Points p = lennard_jones_points(count);
    const Table table(p.r, p.v, lennard_jones_slopes(p));
    double worst = 0;
    for (double r = 0.85; r < 2.9; r += 0.00137)
      worst = std::max(worst, std::abs(table.value(r * r) - LennardJones(1, 1).value(r * r)));
    EXPECT_LT(worst, last / 12);  // order 4
    last = worst;
  }
  EXPECT_LT(last, 2e-5);
}

/// The spline of these points in 50 digits, by its definition: V″ is linear between knots.
class ExactSpline {
 public:
  explicit ExactSpline(const Points& p) {
    const std::size_t n = p.r.size();
    for (std::size_t k = 0; k < n; ++k) {
      rho_.push_back(Precise(p.r[k] * p.r[k]));
      v_.push_back(Precise(p.v[k]));
    }
    second_.assign(n, Precise(0));  // natural
    std::vector<Precise> diagonal(n, 1), right(n, 0);
    for (std::size_t k = 1; k + 1 < n; ++k) {
      const Precise h = rho_[k] - rho_[k - 1], g = rho_[k + 1] - rho_[k];
      diagonal[k] = 2 * (h + g);
      right[k] = 6 * ((v_[k + 1] - v_[k]) / g - (v_[k] - v_[k - 1]) / h);
      if (k == 1) continue;
      const Precise factor = h / diagonal[k - 1];
      diagonal[k] -= factor * h;
      right[k] -= factor * right[k - 1];
    }
    for (std::size_t k = n - 2; k > 0; --k)
      second_[k] = (right[k] - (rho_[k + 1] - rho_[k]) * second_[k + 1]) / diagonal[k];
  }
  Precise operator()(const Precise& rho) const {
    std::size_t k = 0;
    while (k + 2 < rho_.size() && rho >= rho_[k + 1]) ++k;
    const Precise h = rho_[k + 1] - rho_[k], a = (rho_[k + 1] - rho) / h, b = 1 - a;
    return a * v_[k] + b * v_[k + 1] + ((a * a * a - a) * second_[k] + (b * b * b - b) * second_[k + 1]) * h * h / 6;
  }

 private:
  std::vector<Precise> rho_, v_, second_;
};

TEST(Table, QuotientsAreThoseOfTheSplineAlsoAcrossKnots) {
  Points p = lennard_jones_points(60, 0.9);
  p.r[30] += 0.4 * (p.r[31] - p.r[30]);  // unequal distances
  const Table table(p.r, p.v, {});
  const ExactSpline exact(p);
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> uniform(0.9 * 0.9, 9), digits(-17, 0.9), coin(-1, 1);
  double worst = 0, worst_value = 0;
  for (int n = 0; n < 4000; ++n) {
    const double near = p.r[static_cast<std::size_t>(n) % 60];
    const double b =
        n % 2 == 0 ? uniform(random) : std::clamp(near * near * (1 + std::pow(10, digits(random) - 1)), 0.81, 9.0);
    const double a =
        std::clamp(b + (coin(random) < 0 ? -1 : 1) * (n % 10 == 0 ? 0 : std::pow(10, digits(random))), 0.81, 9.0);
    const double quotient = table.quotient(b, a);
    const Precise expected = a == b ? test::precise_derivative(exact, Precise(a))
                                    : Precise((exact(Precise(a)) - exact(Precise(b))) / (Precise(a) - Precise(b)));
    const double scale = 1 + std::abs(table.derivative(std::min(a, b)));  // the largest slope of an interval
    worst = std::max(worst, test::error_in_epsilons(quotient, expected, Precise(scale)));
    worst_value = std::max(worst_value, test::error_in_epsilons(table.value(b), exact(Precise(b)), Precise(1)));
    EXPECT_EQ(quotient, table.quotient(a, b));
  }
  std::printf("    errors in eps: V %.1f, quotient %.1f\n", worst_value, worst);
  EXPECT_LE(worst_value, 6);
  EXPECT_LE(worst, 12);
}

TEST(Table, TheWorkOfAStepIsTheDifferenceOfTheValues) {
  const Points p = lennard_jones_points(60, 0.9);
  const Table table(p.r, p.v, {});
  for (const auto& [b, a] : {std::pair{0.5, 0.7}, {0.5, 0.82}, {0.7, 8.5}, {1.2, 1.2003}, {1.0, 12.0}, {9.5, 12.0}})
    EXPECT_NEAR(table.quotient(b, a) * (a - b), table.value(a) - table.value(b),
                1e-14 * (1 + std::abs(table.value(b))));
}

// Where the spline is zero, errors are relative to a fraction of the largest values at its points.
TEST(Table, ItsScaleIsThatOfTheSplineButNeverZero) {
  const Points p = lennard_jones_points(23);  // the third at the distance 1, where V = 0
  const std::vector<double> slopes = lennard_jones_slopes(p);
  const Table table(p.r, p.v, slopes);
  const auto expect = [&](double distance, double force, double energy) {
    const ForceScale scale = table.scale(distance);
    EXPECT_NEAR(scale.force, force, 1e-12 * force) << distance;
    EXPECT_NEAR(scale.energy, energy, 1e-12 * energy) << distance;
  };
  for (const double r : {0.85, 0.93, 1.07, 1.9, 2.3})
    expect(r, 2 * r * std::abs(table.derivative(r * r)), std::abs(table.value(r * r)));
  expect(0.8, std::abs(slopes.front()), p.v.front());
  expect(0.1, std::abs(slopes.front()), p.v.front());  // not the parabola's, which is larger
  const double most_force = 0x1p-16 * std::abs(slopes.front()), most_energy = 0x1p-16 * p.v.front();
  for (const double beyond : {3.0, 50.0})
    expect(beyond, std::max(most_force, std::abs(slopes.back())), std::max(most_energy, std::abs(p.v.back())));
  EXPECT_EQ(table.value(1.0), 0);
  expect(1, 2 * std::abs(table.derivative(1.0)), most_energy);
  double low = 1.0, high = 1.5;  // around the minimum
  for (int n = 0; n < 60; ++n) (table.derivative(0.5 * (low + high)) < 0 ? low : high) = 0.5 * (low + high);
  expect(std::sqrt(low), most_force, std::abs(table.value(low)));
}

TEST(Table, LanesGetTheBitsOfDoubles) {
  using Two = double __attribute__((vector_size(16)));
  const Points p = lennard_jones_points(60);
  const Cut cut(Table(p.r, p.v, {}), 3, CutKind::switched, 2.7);
  for (double rho = 0.5; rho < 10; rho += 0.0613) {
    const Two b = {rho, 1.3 * rho}, a = {1.05 * rho, 0.4 * rho};
    const Two v = cut.value(b), first = cut.derivative(b), second = cut.second_derivative(b), q = cut.quotient(b, a);
    for (int l = 0; l < 2; ++l) {
      EXPECT_EQ(v[l], cut.value(b[l]));
      EXPECT_EQ(first[l], cut.derivative(b[l]));
      EXPECT_EQ(second[l], cut.second_derivative(b[l]));
      EXPECT_EQ(q[l], cut.quotient(b[l], a[l]));
    }
  }
}

TEST(Table, ItsEndIsCutLikeThatOfOtherPotentials) {
  const Points p = lennard_jones_points(300);
  const Table table(p.r, p.v, lennard_jones_slopes(p));
  for (const CutKind kind : {CutKind::switched, CutKind::shifted, CutKind::force_shifted}) {
    const Cut cut(table, 3, kind, 2.6);
    const Cut expected(LennardJones(1, 1), 3, kind, 2.6);
    for (double r = 0.95; r < 3.2; r += 0.0071) {
      EXPECT_NEAR(cut.value(r * r), expected.value(r * r), 1e-5);
      EXPECT_NEAR(cut.quotient(r * r, 1.1 * r * r), expected.quotient(r * r, 1.1 * r * r), 1e-4);
    }
  }
}

}  // namespace
}  // namespace carom::table_test
