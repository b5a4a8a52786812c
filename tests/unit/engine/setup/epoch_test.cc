// SPDX-License-Identifier: BSD-3-Clause
// The length of an epoch of free flight without a given step: forty mean free times by Enskog's theory, to two digits.

#include "engine/setup/epoch.h"

#include <gtest/gtest.h>

#include "tests/support/experiments.h"

namespace carom::epoch_test {
namespace {

TEST(Epoch, IsFortyMeanFreeTimesInAnyDimension) {
  const double speed = std::sqrt(std::numbers::pi), fraction = 0.3;
  const double disc = fraction / (std::numbers::pi / 4), at_disc = (1 - 7 * fraction / 16) / std::pow(1 - fraction, 2);
  const double discs = default_epoch(*test::hard_spheres<2>(8, fraction));
  EXPECT_NEAR(discs * 2 * disc * at_disc * speed, 40, 0.05 * 40);
  const double sphere = fraction / (std::numbers::pi / 6), at_sphere = (1 - fraction / 2) / std::pow(1 - fraction, 3);
  const double spheres = default_epoch(*test::hard_spheres<3>(5, fraction));
  EXPECT_NEAR(spheres * 4 * sphere * at_sphere * speed, 40, 0.05 * 40);
}

/// As long as the way of forty mean free times is at most four edges, and that time beyond, however small the spheres:
/// walls only make a difference because there are no images to count.
TEST(Epoch, DoesNotDependOnTheSizeOfSmallSpheres) {
  const double speed = std::sqrt(std::numbers::pi);
  for (const Boundary boundary : {Boundary::periodic, Boundary::wall})
    for (const double radius : {0.25, 1e-2, 1e-3, 1e-5, 1e-9}) {
      auto system = test::hard_spheres<3>(5, 0.3);
      system->box.edges = {200, 100, 100};
      system->box.boundary.fill(boundary);
      for (double& each : system->particles.radius) each = radius;
      const double density = 500 / 2e6, forty = 40 / (16 * density * radius * radius * speed);
      const double images = (Packing<3>(1, 500).largest() - 1) * 100 / (8 * std::numbers::sqrt2);
      const double most = boundary == Boundary::periodic ? std::min(800.0, images) : 800.0;
      EXPECT_NEAR(default_epoch(*system) / std::min(forty, most), 1, 0.06) << radius;
      // In the next one the digits are lost that the box has lost already.
      const double next = next_epoch(*system, {.length = 400, .events = 1, .boxes = 2});
      double fastest = 0;
      for (const auto& v : system->particles.v) fastest = std::max(fastest, v.norm());
      if (boundary == Boundary::wall) {
        EXPECT_NEAR(next * fastest, std::max(8192 * radius, 800.0), 1e-9) << radius;
      }
    }
}

/// The next epoch has forty events of a sphere, but is not too long for the images and the digits.
TEST(Epoch, FollowsTheEventsOfTheLast) {
  const auto plain = test::hard_spheres<3>(5, 0.3);
  EXPECT_NEAR(next_epoch(*plain, {.length = 1, .events = 20, .boxes = 0}), 2, 1e-12);
  EXPECT_NEAR(next_epoch(*plain, {.length = 1, .events = 80, .boxes = 0}), 0.5, 1e-12);
  EXPECT_NEAR(next_epoch(*plain, {.length = 0.1, .events = 0, .boxes = 0}), 6.4, 1e-12);
  const double count = Packing<3>(1, plain->size()).largest(), edge = plain->box.edges[0];
  const auto with = [](auto&& change, double boxes) {
    auto system = test::hard_spheres<3>(5, 0.3);
    change(*system);
    return next_epoch(*system, {.length = 1, .events = 0, .boxes = boxes});
  };
  const auto fast = [](double speed) { return [=](auto& system) { system.particles.v[3] = {0, speed, 0}; }; };
  EXPECT_NEAR(with(fast(1e3), 0.5), 4.096, 1e-12);                         // digits
  EXPECT_NEAR(with(fast(1e3), 20), count * count / (21 * 21) / 4, 1e-12);  // wanders
  EXPECT_NEAR(with(fast(100), 10), count / 4 * edge / 100, 1e-12);         // flies straight
  EXPECT_NEAR(with(fast(100), 5), count / 4 / 6, 1e-12);                   // has come less far than that
  EXPECT_EQ(with(
                [](auto& system) {
                  system.box.boundary[0] = Boundary::wall;
                  system.box.add({.name = "x-", .velocity = 0.1});
                },
                0),
            0);
  // The hottest end of a ramp counts, be it the first or the last.
  const auto ramp = [&](double first, double last) {
    return with(
        [=](auto& system) {
          system.box.bath = {.type = Bath::Type::andersen, .temperature = first, .last_temperature = last};
        },
        0);
  };
  EXPECT_NEAR(ramp(1e8, 1e8), 4096 / 5e4, 1e-12);
  EXPECT_EQ(ramp(1e8, 1), ramp(1e8, 1e8));
  EXPECT_EQ(ramp(1, 1e8), ramp(1e8, 1e8));
}

/// On periodic axes the images of two particles as fast as the fastest must fit into their bits; the lightest particle
/// in equilibrium moves at most four boxes.
TEST(Epoch, EndsBeforeAParticleHasComeThroughTooManyBoxes) {
  const auto usual = test::hard_spheres<3>(4, 0.3);
  const double boxes = Packing<3>(1, usual->size()).largest(), edge = usual->box.edges[0];
  const auto system = [](double speed, Boundary boundary) {
    auto made = test::hard_spheres<3>(4, 0.3);
    made->particles.mass[7] = 1e-16;
    made->particles.v[7] = {speed, 0, 0};
    made->box.boundary.fill(boundary);
    return made;
  };
  EXPECT_NEAR(default_epoch(*system(1e10, Boundary::periodic)) * 1e10 / ((boxes - 1) / 2 * edge), 1, 0.05);
  for (const Boundary boundary : {Boundary::periodic, Boundary::wall})
    EXPECT_NEAR(default_epoch(*system(0, boundary)) * 1e8 / (4 * edge), 1, 0.05);
}

}  // namespace
}  // namespace carom::epoch_test
