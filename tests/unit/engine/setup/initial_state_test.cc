// SPDX-License-Identifier: BSD-3-Clause
// Overlaps and spheres that are not inside the walls are the same on any number of ranks.

#include "engine/setup/initial_state.h"

#include <gtest/gtest.h>

#include "tests/support/experiments.h"
#include "tests/support/thread_ranks.h"

namespace carom::initial_state_test {
namespace {

/// Discs between walls along axis 1, some of which reach through a wall or overlap, in every block of ids.
std::unique_ptr<System<2>> spoilt() {
  std::vector<Vec<2>> x;
  std::vector<double> radius;
  for (int k = 0; k < 40; ++k) {
    x.push_back({0.7 + 1.25 * (k % 8), 0.7 + 1.25 * (k / 8)});
    radius.push_back(0.4 + 0.05 * (k % 3));
  }
  for (const int k : {1, 9, 22, 33}) x[k][0] += 0.36 + 0.01 * k;  // 33 overlaps 34 most
  for (const int k : {4, 36}) x[k][1] += k == 4 ? -0.5 : 0.4;
  auto system = test::make_system<2>({10, 6.4}, Boundary::periodic, x, std::vector<Vec<2>>(40, Vec<2>::Zero()), radius);
  system->box.boundary[1] = Boundary::wall;
  return system;
}

TEST(InitialState, OutsidersAndOverlapsAreThoseOfOneRank) {
  const auto whole = spoilt();
  const Outsiders out = find_outsiders(*whole);
  EXPECT_EQ(out.spheres, 2u);
  EXPECT_EQ(out.worst, 4u);
  EXPECT_EQ(out.wall, 2u);
  EXPECT_NEAR(out.depth, 0.25, 1e-12);
  const Overlaps overlaps = find_overlaps(*whole);
  EXPECT_EQ(overlaps.pairs, 4u);
  EXPECT_EQ(overlaps.lo, 33u);
  EXPECT_EQ(overlaps.hi, 34u);
  for (const int ranks : {1, 2, 3, 5})
    test::ThreadRanks(ranks).run([&](Communicator& exchange) {
      const auto system = spoilt();
      system->decomposition.join(exchange);
      const Outsiders far = find_outsiders(*system);
      EXPECT_EQ(std::tuple(far.spheres, far.worst, far.wall, far.depth),
                std::tuple(out.spheres, out.worst, out.wall, out.depth));
      const Overlaps near = find_overlaps(*system);
      EXPECT_EQ(std::tuple(near.pairs, near.lo, near.hi, near.distance, near.contact),
                std::tuple(overlaps.pairs, overlaps.lo, overlaps.hi, overlaps.distance, overlaps.contact));
    });
}

}  // namespace
}  // namespace carom::initial_state_test
