// SPDX-License-Identifier: BSD-3-Clause
// The mean acceleration of the next slab is extrapolated from slabs of any lengths.

#include "engine/integrators/extrapolation.h"

#include <gtest/gtest.h>

namespace carom::extrapolation_test {
namespace {

using integrator::Extrapolation;

/// The mean over a slab of an acceleration that is a polynomial of this degree in time, for each of two particles.
std::vector<Vec<2>> mean(int degree, double start, double length) {
  std::vector<Vec<2>> a(2, Vec<2>::Zero());
  for (int p = 0; p <= degree; ++p) {
    const double power = (std::pow(start + length, p + 1) - std::pow(start, p + 1)) / ((p + 1) * length);
    a[0] += Vec<2>(1.0 + p, -2.0 + p) * power;
    a[1] += Vec<2>(0.5 - p, 3.0) * power;
  }
  return a;
}

struct Slabs {
  explicit Slabs(int of_degree) : degree(of_degree) {
    fields.add("position", x);
    past.start(fields, mean(0, 0, 1));
  }
  void pass(double length) {
    past.pass(length, mean(degree, time, length));
    time += length;
  }
  /// The largest error of the prediction for the next slab.
  double error(double length, std::size_t most = 3) {
    std::vector<Vec<2>> expected(2, Vec<2>::Constant(77));
    past.expect(length, expected, most);
    const std::vector<Vec<2>> right = mean(degree, time, length);
    return std::max((expected[0] - right[0]).norm(), (expected[1] - right[1]).norm());
  }
  int degree;
  double time = 0.25;
  std::vector<Vec<2>> x{2};
  Fields fields;
  Extrapolation<2> past;
};

/// After n slabs an acceleration of degree n − 1 is predicted exactly, and one of degree n is not.
TEST(Extrapolation, ContinuesPolynomialsOverSlabsOfUnequalLengths) {
  for (const std::vector<double>& lengths :
       {std::vector{0.5, 0.2, 0.7, 0.3}, {0.1, 0.25, 0.6, 0.5}, {0.4, 0.4, 0.4, 0.4}, {0.3, 0.3, 0.1, 0.3}})
    for (int degree = 0; degree <= 3; ++degree) {
      Slabs slabs(degree);
      for (std::size_t n = 1; n <= lengths.size(); ++n) {
        slabs.pass(lengths[n - 1]);
        for (const double next : {0.2, 0.5, 0.9})
          for (std::size_t most = 1; most <= 3 && next <= 3 * lengths[n - 1]; ++most) {
            const bool exact = degree < static_cast<int>(std::min({n, most, std::size_t{3}}));
            EXPECT_EQ(slabs.error(next, most) < 1e-12, exact) << degree << " after " << n << ", of " << most;
          }
      }
    }
}

TEST(Extrapolation, FromASlabThatIsMuchShorterOnlyItsOwnIsTaken) {
  Slabs slabs(1);
  for (const double length : {0.5, 0.5, 0.1}) slabs.pass(length);
  EXPECT_LT(slabs.error(0.3), 1e-12);
  std::vector<Vec<2>> expected(2);
  slabs.past.expect(0.301, expected);
  EXPECT_EQ(expected, slabs.past.last());
  slabs.past.expect(0.3, expected);  // slabs before this one are ignored
  EXPECT_EQ(expected, slabs.past.last());
}

}  // namespace
}  // namespace carom::extrapolation_test
