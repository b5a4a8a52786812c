// SPDX-License-Identifier: BSD-3-Clause
// Every pair potential against 50-digit arithmetic; the number of ε is the one that its header promises.

#include <boost/math/special_functions/erf.hpp>

#include "engine/forces/potentials/damped_coulomb.h"
#include "engine/forces/potentials/ewald_pair.h"
#include "engine/forces/potentials/harmonic_bond.h"
#include "engine/forces/potentials/inverse_distance.h"
#include "engine/forces/potentials/inverse_power.h"
#include "engine/forces/potentials/lennard_jones.h"
#include "engine/forces/potentials/morse.h"
#include "engine/forces/potentials/wca.h"
#include "engine/forces/potentials/yukawa.h"
#include "tests/unit/potentials/accuracy.h"

namespace carom::potentials_test {
namespace {

using test::expect_within;
using test::measure;
using test::Precise;

TEST(Accuracy, HarmonicBond) {
  const double k = 1.7, length = 2.1;
  const auto exact = [&](const Precise& rho) {
    const Precise stretch = sqrt(rho) - Precise(length);
    return Precise(Precise(k) / 2 * stretch * stretch);
  };
  const auto scale = [&](const Precise& rho) {
    return Precise(Precise(k) / 2 * (rho + 2 * Precise(length) * sqrt(rho)));
  };
  // The value is of order L² near r = 0, where the scale of its derivative goes to zero: compared from r = 0.1 L on.
  expect_within(measure(HarmonicBond(k, length), exact, scale, 0.04, 1e6), 4);
}

TEST(Accuracy, HarmonicBondNearItsRestLength) {
  const double k = 1.7, length = 2.1;
  const auto exact = [&](const Precise& rho) {
    const Precise stretch = sqrt(rho) - Precise(length);
    return Precise(Precise(k) / 2 * stretch * stretch);
  };
  const auto scale = [&](const Precise& rho) {
    return Precise(Precise(k) / 2 * (rho + 2 * Precise(length) * sqrt(rho)));
  };
  expect_within(measure(HarmonicBond(k, length), exact, scale, 4.40999, 4.41001), 4);
}

TEST(Accuracy, SpringOfZeroLengthIsFiniteWhereItsEndsMeet) {
  const HarmonicBond spring(3.0, 0.0);
  EXPECT_EQ(spring.value(0.0), 0);
  EXPECT_EQ(spring.derivative(0.0), 1.5);
  EXPECT_EQ(spring.second_derivative(0.0), 0);
  EXPECT_EQ(spring.quotient(0.0, 0.0), 1.5);
}

TEST(Accuracy, InverseDistance) {
  const auto exact = [](const Precise& rho) { return Precise(Precise(-1.3) / sqrt(rho)); };
  expect_within(measure(InverseDistance(-1.3), exact, exact, 1e-12, 1e12), 4);
}

TEST(Accuracy, DampedCoulomb) {
  const double c = 1.9;
  for (const double alpha : {0.0, 0.2, 1.1, 3.0}) {
    const auto exact = [&](const Precise& rho) {
      const Precise r = sqrt(rho);
      return Precise(Precise(c) * boost::math::erfc(Precise(alpha) * r) / r);
    };
    const auto rounding = [&](double rho, double) { return 1 + alpha * alpha * rho; };
    expect_within(measure(DampedCoulomb(c, alpha), exact, exact, 1e-6, 30, rounding, 600), 4);
  }
}

TEST(Accuracy, EwaldPair) {
  const double c = 1.9;
  for (const double alpha : {0.3, 1.1, 2.5})
    for (const double range : {1.0, 2.3, 4.0, 6.0}) {  // α times the end
      const double end = range / alpha;
      const auto exact = [&](const Precise& rho) {
        const Precise r = sqrt(rho);
        return Precise(Precise(c) * boost::math::erfc(Precise(alpha) * r) / r);
      };
      const auto scale = [&](const Precise& rho) { return Precise(Precise(c) / sqrt(rho)); };
      const auto rounding = [](double, double) { return 1.0; };
      // The steps of measure() lead to 11 ρ.
      expect_within(measure(EwaldPair(c, alpha, end, 0), exact, scale, 1e-6, end * end / 11.1, rounding, 200), 4);
    }
}

TEST(Accuracy, EwaldPairWithoutItsLastTerms) {
  for (const double range : {1.5, 3.0, 5.0})
    for (double error = 1e-2; error > 1e-13; error /= 10) {
      const EwaldPair pair(1, 1, range, error);
      double most = 0;
      for (int n = 1; n <= 1000; ++n) {
        const double rho = range * range * n / 1000, r = std::sqrt(rho);
        const double exact = -0.5 * (std::erfc(r) / r + 2 / std::sqrt(std::acos(-1)) * std::exp(-rho)) / rho;
        most = std::max(most, std::abs(pair.derivative(rho) - exact) - 1e-15 / (r * rho));
      }
      EXPECT_LE(most, error);
      EXPECT_GE(most, 0.01 * error);
    }
}

TEST(Accuracy, Yukawa) {
  const double amplitude = -2.3;
  for (const double kappa : {0.0, 0.4, 1.8, 12.0}) {
    const auto exact = [&](const Precise& rho) {
      const Precise r = sqrt(rho);
      return Precise(Precise(amplitude) * exp(-Precise(kappa) * r) / r);
    };
    const auto rounding = [&](double rho, double) { return 1 + kappa * std::sqrt(rho); };
    expect_within(measure(Yukawa(amplitude, kappa), exact, exact, 1e-8, 1e3, rounding), 4);
  }
}

TEST(Accuracy, LennardJones) {
  const double epsilon = 1.4, sigma = 0.9;
  const auto terms = [&](const Precise& rho, int sign) {
    const Precise u = pow(Precise(sigma * sigma) / rho, 3);
    return Precise(4 * Precise(epsilon) * (u * u + sign * u));
  };
  expect_within(measure(
                    LennardJones(epsilon, sigma), [&](const Precise& rho) { return terms(rho, -1); },
                    [&](const Precise& rho) { return terms(rho, 1); }, 0.01, 1e4),
                6);
}

TEST(Accuracy, WcaAlsoAcrossItsCutoff) {
  const double epsilon = 1.4, sigma = 0.9;
  const Wca wca(epsilon, sigma);
  const auto exact = [&](const Precise& rho) {
    if (rho >= wca.cutoff_squared()) return Precise(0);
    const Precise u = pow(Precise(sigma * sigma) / rho, 3);
    return Precise(Precise(epsilon) * (2 * u - 1) * (2 * u - 1));
  };
  const auto scale = [&](const Precise& rho) {
    const Precise u = pow(Precise(sigma * sigma) / rho, 3);
    return Precise(4 * Precise(epsilon) * (u * u + u));
  };
  expect_within(measure(wca, exact, scale, 0.01, 3), 6);
  EXPECT_EQ(wca.value(wca.cutoff_squared()), 0);
  EXPECT_EQ(wca.quotient(1.1 * wca.cutoff_squared(), 2 * wca.cutoff_squared()), 0);
}

TEST(Accuracy, Morse) {
  const double depth = 1.7, r0 = 1.1;
  for (const double alpha : {0.3, 5.0, 30.0}) {
    const auto terms = [&](const Precise& rho, int sign) {
      const Precise u = exp(-Precise(alpha) * (sqrt(rho) - Precise(r0)));
      return Precise(Precise(depth) * (u * u + sign * 2 * u));
    };
    const auto rounding = [&](double rho, double) { return 1 + alpha * (std::sqrt(rho) + r0) / 2; };
    expect_within(measure(
                      Morse(depth, alpha, r0), [&](const Precise& rho) { return terms(rho, -1); },
                      [&](const Precise& rho) { return terms(rho, 1); }, 1e-3, 30, rounding),
                  4);
  }
}

TEST(Morse, HoldsThirteenInAnIcosahedron) {  // Doye, Wales, Berry, J. Chem. Phys. 103 (1995) 4234: -42.439863
  const Morse morse(1, 6, 1);
  const double radius2 = 0.96470275 * 0.96470275, golden2 = 0.5 * (3 + std::sqrt(5.0)), edge2 = 4 / (1 + golden2);
  const auto pairs = [&](int count, double over_radius2) { return count * morse.value(over_radius2 * radius2); };
  EXPECT_NEAR(pairs(12, 1) + pairs(30, edge2) + pairs(30, edge2 * golden2) + pairs(6, 4), -42.439863, 5e-7);
}

TEST(Accuracy, InversePower) {
  const double epsilon = 0.8, sigma = 1.3;
  for (const double exponent : {1.0, 4.5, 12.0, 36.0}) {
    const auto exact = [&](const Precise& rho) {
      return Precise(Precise(epsilon) * pow(Precise(sigma * sigma) / rho, Precise(exponent) / 2));
    };
    const auto rounding = [&](double, double) { return 1 + 0.25 * exponent; };
    expect_within(measure(InversePower(epsilon, sigma, exponent), exact, exact, 0.01, 1e4, rounding), 3);
  }
}

}  // namespace
}  // namespace carom::potentials_test
