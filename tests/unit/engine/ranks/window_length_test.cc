// SPDX-License-Identifier: BSD-3-Clause
// Windows end before a sphere may move too far, their number follows the collisions, and a sphere that is too fast is
// found.

#include "engine/ranks/window_length.h"

#include <gtest/gtest.h>

#include "tests/unit/engine/ranks/window_cases.h"

namespace carom::window_length_test {
namespace {

/// Calls visit(length) for each window up to `end`.
template <int D, class Visit>
void for_each_window(const WindowLength<D>& length, double end, Visit&& visit) {
  for (double now = 0; now < end;) {
    const double next = length.window_end(now, end);
    ASSERT_GT(next, now);
    ASSERT_LE(next, end);
    visit(next - now);
    now = next;
  }
}

struct Fluid {
  std::unique_ptr<System<3>> system = test::hard_spheres<3>(5, 0.3);
  Sizes sizes{system->particles};
  Communicator alone;
  double fastest() const {
    double most = 0;
    for (const auto& v : system->particles.v) most = std::max(most, v.norm());
    return most;
  }
};

TEST(WindowLength, NoSphereComesFartherThanAllowedForInAWindow) {
  const Fluid f;
  for (const Vec<3>& g : {Vec<3>(0, 0, 0), Vec<3>(0, 3, -4)}) {
    WindowLength<3> length(1);
    Communicator alone;
    length.start(f.system->box, f.sizes, alone, f.system->particles, g, 0.8);
    EXPECT_GT(length.max_displacement(), 0.02);
    EXPECT_LE(length.max_displacement(), 1);
    std::size_t windows = 0;
    for_each_window(length, 0.8, [&](double window) {
      EXPECT_LE((f.fastest() + g.norm() * 0.8) * window, length.max_displacement());
      ++windows;
    });
    EXPECT_GT(windows, 1u);
  }
}

TEST(WindowLength, FollowsTheRateOfCollisionsAndIsForced) {
  Fluid f;
  WindowLength<3> length(1), forced(1, [] { return 0.001; });
  for (WindowLength<3>* each : {&length, &forced})
    each->start(f.system->box, f.sizes, f.alone, f.system->particles, Vec<3>::Zero(), 0.8);
  for_each_window(forced, 0.01, [](double window) { EXPECT_NEAR(window, 0.001, 1e-9); });
  const auto first = [&] { return length.window_end(0, 100); };
  const double before = first();
  length.note(1, 1);  // few collisions in a window, as at the start from a lattice, do not make later ones long
  length.start(f.system->box, f.sizes, f.alone, f.system->particles, Vec<3>::Zero(), 0.8);
  EXPECT_LT(first(), 1.2 * before);
  for (int k = 0; k < 200; ++k) length.note(0.01, 250);  // each collides once in 0.01
  EXPECT_NEAR(first(), 0.0015, 1e-5);
}

/// A heavy sphere hits a light one that moved towards it, which then has nearly twice its speed.
TEST(WindowLength, FindsWhetherASphereMayHaveComeTooFar) {
  const auto system =
      test::make_system<3>({20, 6, 6}, P, {{2, 3, 3}, {3.25, 3, 3}}, {{1, 0, 0}, {0.2, 0, 0}}, {0.5, 0.5}, {1.0, 0.01});
  const Sizes sizes(system->particles);
  Communicator alone;
  const Bisection<3> bisection(system->box, system->particles.x, 1, 1 + 2 * kDisplacement, alone);
  const auto subdomain = subdomain_of(*system, sizes, bisection, alone, 2);
  subdomain->run(0, 2);
  for (const double g : {0.0, 0.1}) {
    WindowLength<3> length(1);
    length.start(system->box, sizes, alone, system->particles, {g, 0, 0}, 2);
    ASSERT_EQ(length.max_displacement(), 1);
    const double before = length.window_end(0, 2), speed = 0.2 + 2 / 1.01 * 0.8, fastest = speed + 2 * g;
    EXPECT_NEAR(subdomain->fastest(), speed, 1e-9);
    EXPECT_TRUE(length.too_fast(speed, 1.001 / fastest));
    EXPECT_FALSE(length.too_fast(speed, 0.999 / fastest));
    EXPECT_FALSE(length.too_fast(1.1, 2));  // as fast as was expected
    length.allow_for(speed);
    EXPECT_LT(length.window_end(0, 2), before);
    EXPECT_FALSE(length.too_fast(speed, length.window_end(0, 2)));
  }
}

}  // namespace
}  // namespace carom::window_length_test
