// SPDX-License-Identifier: BSD-3-Clause
// Bodies at rest for 10⁴ steps, and impacts on bodies at rest: edda against cdda at small steps.

#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "tests/support/experiments.h"
#include "tests/support/static_scenes.h"

namespace carom::rest_and_impact_test {
namespace {

template <int D>
void expect_long_rest(test::StaticScene<D> scene) {
  const auto start = scene.system->particles.x;
  const auto run = test::run_steps<D>(std::move(scene.system), "edda", 0.01, 10'000);
  const Statistics& s = run->statistics();
  EXPECT_LE(test::largest_difference<D>(run->system().particles.x, start), 1e-12 * 0.5);
  EXPECT_LE(s.max_energy_error, 1e-12 * s.energy_reference);
  EXPECT_LE(s.counters.max_overlap, 1e-12);
  std::printf("%zu bodies at rest: %.2f force passes a step\n", start.size(), s.force_passes / 10'000);
}

TEST(RestSlow, Columns) {
  for (const int n : {2, 5, 10, 20, 50}) expect_long_rest(test::column(n));
}
TEST(RestSlow, Pyramid) { expect_long_rest(test::pyramid(8)); }
TEST(RestSlow, Crystal) { expect_long_rest(test::crystal(500)); }
TEST(RestSlow, Arch) { expect_long_rest(test::arch(4)); }
TEST(RestSlow, HangingChain) { expect_long_rest(test::hanging_chain()); }
TEST(RestSlow, RowUnderAttraction) { expect_long_rest(test::row_under_attraction(3)); }
TEST(RestSlow, Heap) { expect_long_rest(test::heap(14)); }  // 1015 spheres

/// An impact on bodies at rest, in a trap in the middle of the floor, which bends paths.
template <int D>
struct Impact {
  Particle<D> striker;
  double end;         // shortly after the impact, before small differences grow
  double trap = 0.2;  // stiffness
};

template <int D, typename Scene>
std::vector<Vec<D>> after_impact(Scene&& make, const Impact<D>& impact, const char* method, double h) {
  auto scene = test::in_trap(make(), impact.trap);
  scene.system->particles.add(impact.striker);
  const auto run = test::run_until<D>(std::move(scene.system), method, h, impact.end);
  const Statistics& s = run->statistics();
  EXPECT_LE(s.max_energy_error, 1e-12 * s.energy_reference) << method << " " << h;
  EXPECT_LE(s.counters.max_overlap, 1e-12) << method << " " << h;
  EXPECT_GT(s.counters.sphere_sphere, 0u) << method << " " << h;
  return run->system().particles.x;
}

/// edda converges to the motion of cdda at small steps.
template <int D, typename Scene>
void expect_convergence(Scene&& make, const Impact<D>& impact) {
  const auto exact = after_impact<D>(make, impact, "cdda", 0.0005);
  std::vector<double> steps = {0.016, 0.008, 0.004, 0.002}, errors;
  for (const double h : steps) {
    errors.push_back(test::largest_difference<D>(after_impact<D>(make, impact, "edda", h), exact));
    std::printf("step %.3f: error %.1e\n", h, errors.back());
  }
  EXPECT_LE(errors.back(), 1e-5);
  // In a large crystal the two methods differ by the rounding that the impact amplifies, 4e-7 at any step.
  constexpr double kAmplifiedRounding = 5e-7;
  if (errors.back() < kAmplifiedRounding) errors.pop_back(), steps.pop_back();
  const double order = test::fitted_order(steps, errors);
  EXPECT_GT(order, 1.8);
}

TEST(Impact, OnTopOfAColumn) {
  expect_convergence<2>([] { return test::column(5); }, {{.x = {2, 6}, .v = {0, -1}, .mass = 0.3}, 1.0});
}
TEST(Impact, BesideTheTopOfAColumn) {
  expect_convergence<2>([] { return test::column(5); }, {{.x = {2.2, 6}, .v = {0, -1}, .mass = 0.3}, 1.0});
}
TEST(Impact, OnTheSideOfAColumn) {
  expect_convergence<2>([] { return test::column(5); }, {{.x = {0.7, 2.75}, .v = {1, 0}}, 0.6});
}
TEST(Impact, OnASmallCrystal) {
  expect_convergence<2>([] { return test::trapped_crystal(5); },
                        {{.x = {4.2, 3.7}, .v = {0.1, -1}, .mass = 0.7}, 0.6, 0});
}
TEST(Impact, OnALargeCrystal) {
  expect_convergence<2>([] { return test::trapped_crystal(15); }, {{.x = {8.3, 8.2}, .v = {0.1, -1}}, 0.4, 0});
}
TEST(Impact, OnAnArch) {
  expect_convergence<2>([] { return test::arch(2); }, {{.x = {1.2, 3.8}, .v = {0, -1}}, 0.6});
}
TEST(Impact, OnAHeap) {
  expect_convergence<3>([] { return test::trapped_heap(); }, {{.x = {3.13, 2.95, 2.4}, .v = {0, 0, -1}}, 0.4, 0});
}
TEST(Impact, OnAHangingChain) {
  expect_convergence<2>([] { return test::hanging_chain(); }, {{.x = {3.2, 5}, .v = {0, -1}}, 0.8, 0});
}

TEST(Impact, OnARowThatFillsTheBoxIsRefused) {
  // The lowest row of the pyramid has no space to separate, so no sequence of elastic collisions lets it move apart.
  for (const char* method : {"cdda", "edda"}) {
    SCOPED_TRACE(method);
    try {
      after_impact<2>([] { return test::pyramid(3); }, {{.x = {1.7, 3.7}, .v = {0.1, -1}, .mass = 0.7}, 0.6}, method,
                      0.008);
      FAIL() << "no error";
    } catch (const Error& error) {
      EXPECT_EQ(error.failure(), Failure::numerical);
      const std::string what = error.what();
      EXPECT_NE(what.find("have no room to part; leave gaps"), std::string::npos) << what;
    }
  }
}

}  // namespace
}  // namespace carom::rest_and_impact_test
