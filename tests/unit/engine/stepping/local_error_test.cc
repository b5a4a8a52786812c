// SPDX-License-Identifier: BSD-3-Clause
#include "engine/stepping/local_error.h"

#include <gtest/gtest.h>

#include "tests/support/experiments.h"

namespace carom::local_error_test {
namespace {

using Vectors2 = std::vector<Vec<2>>;

std::unique_ptr<System<2>> three(std::vector<double> radius) {
  return test::make_system<2>(Vec<2>{10, 10}, Boundary::wall, {{2, 2}, {5, 5}, {8, 8}}, {{0, 0}, {0, 0}, {0, 0}},
                              std::move(radius));
}

TEST(LocalError, IsThatOfAnAccelerationThatChangesAtAConstantRate) {
  const auto system = three({0.5, 0.5, 0.5});
  const double j = 3, h = 0.2, before = 0.05;
  // The means over two steps that meet at time 0.
  const Vectors2 a = {{1, 0}, {0, j * h / 2}, {0, 0}}, a_before = {{1, 0}, {0, -j * before / 2}, {0, 0}};
  const LocalError error = local_error<2>(*system, a, a_before, h, before, 0);
  EXPECT_NEAR(error.of(h), j * h * h * h / 12, 1e-15);
  EXPECT_EQ(error.id, 1);
  // From an instant at the start of the step.
  const LocalError first = local_error<2>(*system, a, Vectors2{{1, 0}, {0, 0}, {0, 0}}, h, 0, 0);
  EXPECT_NEAR(first.of(h), j * h * h * h / 12, 1e-15);
}

TEST(LocalError, IsRelativeToTheDiameterOrToTheMeanDistanceOfPoints) {
  const Vectors2 a = {{1, 0}, {0, 1}, {0, 0}}, none(3, Vec<2>::Zero());
  const auto spheres = three({0.5, 0.25, 0.5}), points = three({0, 0, 0});
  const double rate = 1 / (6 * 0.2);
  EXPECT_DOUBLE_EQ(local_error<2>(*spheres, a, none, 0.1, 0.1, 0).rate, rate / 0.5);
  EXPECT_EQ(local_error<2>(*spheres, a, none, 0.1, 0.1, 0).id, 1);
  EXPECT_DOUBLE_EQ(local_error<2>(*points, a, none, 0.1, 0.1, 0).rate, rate / std::sqrt(100.0 / 3));
  EXPECT_EQ(local_error<2>(*points, a, none, 0.1, 0.1, 0).id, 0);  // the smallest id of two
}

TEST(LocalError, IgnoresNoise) {
  const auto system = three({0.5, 0.5, 0.5});
  const Vectors2 a = {{1e-9, 0}, {0, 0}, {0, 0}}, none(3, Vec<2>::Zero());
  EXPECT_EQ(local_error<2>(*system, a, none, 0.1, 0.1, 2e-9).rate, 0);
  EXPECT_GT(local_error<2>(*system, a, none, 0.1, 0.1, 0.5e-9).rate, 0);
}

TEST(LocalError, AStepIsTooLongIfItIsTwiceTheStepThatIsWanted) {
  const LocalError error{.rate = 1, .id = 7};
  EXPECT_NO_THROW(need_accuracy(error, 1e-3, 0.1999, 0.1999));
  EXPECT_NO_THROW(need_accuracy(error, 0, 5, 5));  // fixed steps
  try {
    need_accuracy(error, 1e-3, 0.201, 0.3);
    FAIL();
  } catch (const StepTooLong& wanted) {
    EXPECT_DOUBLE_EQ(wanted.length, 0.15);
    EXPECT_EQ(wanted.id, 7);
  }
  EXPECT_THROW(need_accuracy({.rate = std::numeric_limits<double>::quiet_NaN()}, 1e-3, 0.1, 0.1), StepTooLong);
}

}  // namespace
}  // namespace carom::local_error_test
