// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Measures a potential's four functions against 50-digit arithmetic, over wide ranges of ρ and of the step from ρ to
// ρ'.
//
// The exact results need V(ρ) only: derivatives are computed numerically with 50 digits, the quotient by dividing
// differences. Errors are in ε of a scale that is computed likewise from a function M(ρ), the sum of the magnitudes of
// the terms of V. If V has one term, M = V and the errors are relative; if terms cancel, they are relative to the
// terms.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>

#include "engine/forces/potentials/potential.h"
#include "tests/unit/potentials/precise.h"

namespace carom::test {

/// The largest errors found, in ε of the scale.
struct Errors {
  double value = 0, derivative = 0, second_derivative = 0, quotient = 0;
};

template <class F>
Precise precise_derivative(F f, const Precise& rho) {
  const Precise h = rho * Precise("1e-15");
  return (f(rho + h) - f(rho - h)) / (2 * h);
}

template <class F>
Precise precise_second_derivative(F f, const Precise& rho) {
  const Precise h = rho * Precise("1e-12");
  return (f(rho + h) - 2 * f(rho) + f(rho - h)) / (h * h);
}

template <class F>
Precise precise_quotient(F f, const Precise& b, const Precise& a) {
  return a == b ? precise_derivative(f, a) : Precise((f(a) - f(b)) / (a - b));
}

/// Compares at ρ log-uniform in [from, to] and ρ' = ρ (1 ± δ), δ from 1e-17 to 10 and 0. `allowed(ρ, δ)` is a factor on
/// ε for potentials whose arguments are rounded.
template <Potential P, class V, class M, class Allowed>
Errors measure(const P& potential, V exact, M scale, double from, double to, Allowed allowed, int count = 1500) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> exponent(std::log(from), std::log(to)), difference(-17, 1), coin(-1, 1);
  Errors worst;
  const auto take = [](double& largest, double error) {
    if (!(error <= largest)) largest = error;
  };
  for (int n = 0; n < count; ++n) {
    const double b = std::exp(exponent(random));
    const double delta = n % 10 == 0 ? 0 : std::pow(10, difference(random));
    const double a = coin(random) < 0 ? b / (1 + delta) : b * (1 + delta);
    const Precise rho(b), rho_new(a);
    const double unit = allowed(b, delta);
    take(worst.value, error_in_epsilons(potential.value(b), exact(rho), scale(rho)) / unit);
    take(worst.derivative,
         error_in_epsilons(potential.derivative(b), precise_derivative(exact, rho), precise_derivative(scale, rho)) /
             unit);
    take(worst.second_derivative,
         error_in_epsilons(potential.second_derivative(b), precise_second_derivative(exact, rho),
                           precise_second_derivative(scale, rho)) /
             unit);
    take(worst.quotient, error_in_epsilons(potential.quotient(b, a), precise_quotient(exact, rho, rho_new),
                                           precise_quotient(scale, rho, rho_new)) /
                             unit);
    EXPECT_EQ(potential.quotient(b, a), potential.quotient(a, b)) << "not symmetric at " << b << ", " << a;
  }
  std::printf("    errors in eps: V %.2f, V' %.2f, V'' %.2f, quotient %.2f\n", worst.value, worst.derivative,
              worst.second_derivative, worst.quotient);
  return worst;
}

template <Potential P, class V, class M>
Errors measure(const P& potential, V exact, M scale, double from, double to) {
  return measure(potential, exact, scale, from, to, [](double, double) { return 1.0; });
}

inline void expect_within(const Errors& errors, double limit) {
  EXPECT_LE(errors.value, limit);
  EXPECT_LE(errors.derivative, limit);
  EXPECT_LE(errors.second_derivative, limit);
  EXPECT_LE(errors.quotient, limit);
}

}  // namespace carom::test
