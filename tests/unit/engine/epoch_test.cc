// SPDX-License-Identifier: BSD-3-Clause
// The length of an epoch of free flight without a given step: forty mean free times by Enskog's theory, to two digits.

#include "engine/setup/epoch.h"

#include <gtest/gtest.h>

#include <numbers>

#include "tests/support/experiments.h"

namespace carom {
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

/// On periodic axes the images of the fastest particle, and of the lightest in equilibrium, must fit into their bits.
TEST(Epoch, EndsBeforeAParticleHasComeThroughTooManyBoxes) {
  const auto usual = test::hard_spheres<3>(4, 0.3);
  const double boxes = Packing<3>(1, usual->size()).largest();
  const auto epoch = [](double speed, Boundary boundary) {
    auto system = test::hard_spheres<3>(4, 0.3);
    system->particles.mass[7] = 1e-12;
    system->particles.v[7] = {speed, 0, 0};
    system->box.boundary.fill(boundary);
    return default_epoch(*system);
  };
  for (const auto& [speed, fastest] : {std::pair{6e6, 6e6}, {0.0, 5e6}}) {
    EXPECT_NEAR(epoch(speed, Boundary::periodic) * fastest / (boxes * usual->box.edges[0]), 1, 0.05) << speed;
    EXPECT_NEAR(epoch(speed, Boundary::wall) / default_epoch(*usual), 1, 0.1) << speed;
  }
}

}  // namespace
}  // namespace carom
