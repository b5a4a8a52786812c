// SPDX-License-Identifier: BSD-3-Clause
#include "engine/integrators/sweep_control.h"

#include <gtest/gtest.h>

#include <initializer_list>

namespace carom::sweep_control_test {
namespace {

using integrator::Chebyshev;
using integrator::SweepControl;

constexpr double kRounding = 1e-15;

SweepControl after(std::initializer_list<double> residuals, double wanted = 1e-10) {
  SweepControl control(wanted);
  for (const double each : residuals) control.note(each, kRounding);
  return control;
}

TEST(SweepControl, IsContentWithWhatIsWanted) {
  EXPECT_FALSE(after({1, 1.1e-10}).good_enough());
  EXPECT_TRUE(after({1, 0.9e-10}).good_enough());
  EXPECT_FALSE(after({1, 0.9e-10}).converged());
  SweepControl control = after({1, 0.9e-10});
  control.want_rounding();
  EXPECT_EQ(control.wanted(), 0);
  EXPECT_FALSE(control.good_enough());
}

TEST(SweepControl, ConvergesWhereRoundingKeepsTheResidualUp) {
  EXPECT_TRUE(after({0}).converged());
  EXPECT_TRUE(after({1, 1e-15, 0.3e-15}, 0).converged());
  EXPECT_FALSE(after({1, 1e-15, 0.2e-15}, 0).converged()) << "it still falls";
  EXPECT_FALSE(after({1, 1e-15, 1.1e-15}, 0).converged()) << "it is larger than rounding";
  EXPECT_FALSE(after({1e-15, 0.9e-15}, 0).converged()) << "the first sweep has no path to compare with";
}

TEST(SweepControl, StallsWhereSixSweepsReduceTheResidualByLessThanTen) {
  const auto contraction = [](double last) { return after({1, 1, 1, 1, 1, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, last}); };
  EXPECT_TRUE(contraction(1.01e-4).stalls(0));
  EXPECT_FALSE(contraction(0.99e-4).stalls(0));
  // Stiffness explains a contraction by the sixth power of its rate; half of that remains a stall.
  EXPECT_TRUE(contraction(4.7e-4).stalls(0.78));  // 2 · 0.78⁶ = 0.450
  EXPECT_FALSE(contraction(4.4e-4).stalls(0.78));
  EXPECT_FALSE(contraction(1e-3).stalls(0.8)) << "2 · 0.8⁶ = 0.52 is too stiff to tell";
  EXPECT_FALSE(after({1, 1, 1, 1, 1, 1}).stalls(0)) << "six sweeps have none before them";
  EXPECT_FALSE(after({1, 1, 1, 1, 1, 1, 1}).stalls(0)) << "looks at every sixth sweep";
  SweepControl control(0);
  EXPECT_TRUE(control.may_stall_again());
  EXPECT_TRUE(control.may_stall_again());
  EXPECT_FALSE(control.may_stall_again());
}

TEST(SweepControl, IsSlowWhereTwoSweepsContractLittle) {
  const double small = Chebyshev::kSmall * Chebyshev::kSmall;
  EXPECT_TRUE(after({1, 1, 1, 1, 1.01 * small}).slow());
  EXPECT_FALSE(after({1, 1, 1, 1, 0.99 * small}).slow());
  EXPECT_FALSE(after({1, 1, 1, 1.01 * small}).slow()) << "the fourth sweep is too early";
  EXPECT_FALSE(after({1, 1, 1e-9, 1e-9, 0.99e-9}).slow()) << "it is nearly done";
}

TEST(SweepControl, EndsAfterSixtySweepsAndFreezesFromTheSixthOn) {
  SweepControl control(0);
  for (int sweep = 1; sweep <= 60; ++sweep) {
    EXPECT_TRUE(control.below_limit());
    control.note(1, kRounding);
    EXPECT_EQ(control.sweep(), sweep);
    EXPECT_EQ(control.may_freeze(), sweep >= 6);
  }
  EXPECT_FALSE(control.below_limit());
}

}  // namespace
}  // namespace carom::sweep_control_test
