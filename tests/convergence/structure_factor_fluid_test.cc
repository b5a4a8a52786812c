// SPDX-License-Identifier: BSD-3-Clause
// S(k) of hard spheres against theory.

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <iostream>
#include <numbers>

#include "engine/run/observable.h"
#include "tests/convergence/fluid.h"

namespace carom::structure_factor_fluid_test {
namespace {

constexpr double kPi = std::numbers::pi;

/// Percus and Yevick's S(k) of spheres of diameter 1: Wertheim, Phys. Rev. Lett. 10 (1963) 321; the transform of
/// −c(r) = α + βr + γr³, r < 1.
double percus_yevick(double k, double eta) {
  const double alpha = std::pow(1 + 2 * eta, 2) / std::pow(1 - eta, 4);
  const double beta = -6 * eta * std::pow(1 + eta / 2, 2) / std::pow(1 - eta, 4), gamma = eta * alpha / 2;
  const double sin = std::sin(k), cos = std::cos(k), k2 = k * k, k3 = k2 * k, k4 = k2 * k2;
  const double c = -4 * kPi / k3 *
                   (alpha * (sin - k * cos) + beta / k * (2 * k * sin + (2 - k2) * cos - 2) +
                    gamma / k3 * ((4 * k3 - 24 * k) * sin - (k4 - 12 * k2 + 24) * cos + 24));
  return 1 / (1 - 6 * eta / kPi * c);
}

/// Percus and Yevick's g(r) of spheres of diameter 1 for 1 ≤ r ≤ 2 (Wertheim's solution by the residues of its Laplace
/// transform; Smith, Henderson, Mol. Phys. 19 (1970) 411).
double percus_yevick_g(double r, double eta);

/// Verlet and Weis's correction (Phys. Rev. A 5 (1972) 939): that of a smaller packing fraction and diameter, with the
/// part of g inside the core taken off and a tail that gives g at contact its right value.
double verlet_weis(double k, double eta);

std::complex<double> residue(std::complex<double> t, double r, double eta) {
  const double s1 = 1 - eta;
  const auto L = 12.0 * eta * ((1 + eta / 2) * t + (1 + 2 * eta));
  const auto S1 = 3.0 * s1 * s1 * t * t + 12.0 * eta * s1 * t + 18.0 * eta * eta;
  return t * L / (12 * eta * S1) * std::exp(t * (r - 1));
}

double percus_yevick_g(double r, double eta) {
  // S(t) = (1 − η)²t³ + 6η(1 − η)t² + 18η²t − 12η(1 + 2η); its zeros from Newton's method.
  const auto S = [eta](std::complex<double> t) {
    return (1 - eta) * (1 - eta) * t * t * t + 6 * eta * (1 - eta) * t * t + 18 * eta * eta * t -
           12 * eta * (1 + 2 * eta);
  };
  const auto slope = [eta](std::complex<double> t) {
    return 3 * (1 - eta) * (1 - eta) * t * t + 12 * eta * (1 - eta) * t + 18 * eta * eta;
  };
  std::complex<double> g;
  for (const std::complex<double> start : {std::complex<double>(2, 0), {-2, 2}, {-2, -2}}) {
    std::complex<double> t = start;
    for (int n = 0; n < 100; ++n) t -= S(t) / slope(t);
    g += residue(t, r, eta);
  }
  return g.real() / r;
}

double verlet_weis(double k, double eta) {
  const double smaller = eta - eta * eta / 16, d = std::cbrt(smaller / eta), rho = 6 * eta / kPi;
  const double contact = percus_yevick_g(1 / d, smaller);
  const double right = (1 - eta / 2) / std::pow(1 - eta, 3);  // Carnahan, Starling
  const double amplitude = right - contact;
  const double mu = 24 * amplitude / smaller / percus_yevick_g(1, smaller);
  const auto integral = [&](double from, double to, auto&& of) {  // of h(r) r sin(kr), Simpson's rule
    const int n = 2000;
    double sum = 0;
    for (int i = 0; i <= n; ++i) {
      const double r = from + (to - from) * i / n;
      sum += (i == 0 || i == n ? 1 : i % 2 == 1 ? 4 : 2) * of(r) * r * std::sin(k * r);
    }
    return sum * (to - from) / (3 * n);
  };
  const double inside = integral(d, 1, [&](double r) { return percus_yevick_g(r / d, smaller); });
  const double tail = integral(
      1, 1 + 30 / mu, [&](double r) { return amplitude / r * std::exp(-mu * (r - 1)) * std::cos(mu * (r - 1)); });
  return percus_yevick(k * d, smaller) + 4 * kPi * rho / k * (tail - inside);
}

TEST(StructureFactorOfTheFluid, TheoriesAgreeWithWhatIsKnown) {
  for (const double eta : {0.1, 0.2, 0.3}) {
    EXPECT_NEAR(percus_yevick(0.02, eta), std::pow(1 - eta, 4) / std::pow(1 + 2 * eta, 2), 1e-3);
    EXPECT_NEAR(percus_yevick_g(1, eta), (1 + eta / 2) / std::pow(1 - eta, 2), 1e-9);
    const double compressibility = std::pow(1 - eta, 4) / (std::pow(1 + 2 * eta, 2) + eta * eta * eta * (eta - 4));
    EXPECT_NEAR(verlet_weis(0.02, eta), compressibility, 0.03 * compressibility) << eta;
  }
}

/// At packing fraction 0.30: S of each row within five errors and a percent of Verlet and Weis's, which is that far
/// from exact; S(k → 0), from a parabola in k through the smallest k, that of Carnahan and Starling's equation of
/// state.
TEST(StructureFactorOfTheFluid, IsThatOfVerletAndWeis) {
  const double eta = 0.3;
  auto run = test::make_run<3>(test::molten<3>(500, eta, 1), "free-flight",
                               {.step = 2, .end_time = 110, .thermo_interval = 0.2, .from_equilibrium = true});
  const auto sk = make_observable("sk", run->system(), {{"interval", 0.3}, {"range", 16.0}, {"waves", 10}});
  run->add(*sk);
  run->run();
  const auto table = sk->table();
  ASSERT_EQ(table[2].name, "S");
  ASSERT_EQ(table[3].name, "error_S");
  double chi_square = 0, numerator = 0, weights = 0;
  const std::size_t rows = table[0].values.size();
  for (std::size_t row = 0; row < rows; ++row) {
    const double k = table[0].values[row], s = table[2].values[row], error = table[3].values[row];
    const double theory = verlet_weis(k, eta), t = (s - theory) / std::hypot(error, 0.01 * theory);
    EXPECT_LT(std::abs(t), 5) << "k " << k << ": " << s << " ± " << error << ", theory " << theory << ", Percus–Yevick "
                              << percus_yevick(k, eta);
    chi_square += t * t;
    if (k > 2.5) continue;
    // The shape of the theory takes k to 0.
    const double weight = std::pow(theory / error, 2);
    numerator += weight * s / theory;
    weights += weight;
  }
  const double compressibility = std::pow(1 - eta, 4) / (std::pow(1 + 2 * eta, 2) + eta * eta * eta * (eta - 4));
  const double at_zero = numerator / weights * verlet_weis(0.02, eta), error = at_zero / std::sqrt(weights);
  std::cout << "S(k → 0) = " << at_zero << " ± " << error << ", equation of state " << compressibility
            << "; chi square of " << rows << " rows " << chi_square << std::endl;
  EXPECT_NEAR(at_zero, compressibility, 4 * error + 0.01 * compressibility);
  EXPECT_LT(chi_square, 2.0 * static_cast<double>(rows));
}

}  // namespace
}  // namespace carom::structure_factor_fluid_test
