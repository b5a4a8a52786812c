// Anderson acceleration on its own: linear iterations end after as many sweeps as they have dimensions.

#include "engine/integrators/mixing.h"

#include <gtest/gtest.h>

namespace carom::integrator {
namespace {

/// x → x + (what the plain iteration x → Ax + b adds) + the correction, so many times from zero; what is lacking then.
double left_after(Mixing& mixing, const Eigen::MatrixXd& a, const Eigen::VectorXd& b, int iterations) {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(b.size());
  for (int k = 0; k < iterations; ++k) {
    const Eigen::VectorXd lacking = a * x + b - x;
    mixing.add(x, lacking);
    x += lacking + mixing.correction();
  }
  return (a * x + b - x).norm();
}

Eigen::MatrixXd slow(int size) {  // eigenvalues up to 0.99
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(size, size);
  for (int k = 0; k < size; ++k) a(k, k) = 0.99 - 0.3 * k;
  a(0, 1) = 0.5;
  return a;
}

TEST(Mixing, SolvesALinearIterationInAsManyStepsAsItHasDimensions) {
  for (const int size : {1, 2, 4}) {
    Mixing mixing;
    EXPECT_GT(left_after(mixing, slow(size), Eigen::VectorXd::Ones(size), size), 1e-3) << size;
    mixing.clear();
    EXPECT_LE(left_after(mixing, slow(size), Eigen::VectorXd::Ones(size), size + 1), 1e-12) << size;
  }
}

TEST(Mixing, RemembersNothingOnceCleared) {
  Mixing used;
  left_after(used, slow(4), Eigen::VectorXd::Ones(4), 9);
  for (const int size : {4, 3, 5}) {  // of another size it may be then
    used.clear();
    Mixing fresh;
    EXPECT_EQ(left_after(used, slow(size), Eigen::VectorXd::LinSpaced(size, 1, 2), 3),
              left_after(fresh, slow(size), Eigen::VectorXd::LinSpaced(size, 1, 2), 3));
  }
}

TEST(Mixing, KeepsTheLastSixOnly) {
  // Twelve dimensions, and more iterates than are kept: it goes on contracting far faster than the plain iteration.
  Mixing mixing;
  Eigen::MatrixXd a = Eigen::VectorXd::LinSpaced(12, 0.1, 0.95).asDiagonal();
  const Eigen::VectorXd b = Eigen::VectorXd::Ones(12);
  EXPECT_LE(left_after(mixing, a, b, 40), 1e-6);  // plain: 0.95^40 = 0.13
}

}  // namespace
}  // namespace carom::integrator
