// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Systems for tests that compare runs bit for bit, and the results of such runs.

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "engine/base/random.h"
#include "engine/events/event_core.h"
#include "engine/setup/placement.h"
#include "tests/support/experiments.h"

namespace carom {

inline constexpr Boundary W = Boundary::wall, P = Boundary::periodic, O = Boundary::open;

template <int D>
struct Case {
  std::unique_ptr<System<D>> system;
  Vec<D> g = Vec<D>::Zero();
  double growth = 0;
  double slab = 1;
  int slabs = 3;
};

/// The results of a run: every contact and the last state.
template <int D>
struct Outcome {
  std::vector<Contact<D>> contacts;
  Particles<D> particles;
};

template <int D>
std::uint64_t bits_of(const std::vector<Vec<D>>& x) {
  std::uint64_t sum = 0;
  for (const auto& v : x)
    for (int k = 0; k < D; ++k) {
      std::uint64_t bits;
      std::memcpy(&bits, &v[k], sizeof bits);
      sum = sum * 0x100000001b3 + bits;
    }
  return sum;
}

template <int D>
void expect_same(const Outcome<D>& a, const Outcome<D>& b, const std::string& what) {
  ASSERT_EQ(a.contacts.size(), b.contacts.size()) << what;
  for (std::size_t k = 0; k < a.contacts.size(); ++k) {
    ASSERT_TRUE(a.contacts[k].key == b.contacts[k].key) << what << ", contact " << k;
    ASSERT_EQ(a.contacts[k].impulse, b.contacts[k].impulse) << what << ", contact " << k;
    ASSERT_EQ(a.contacts[k].x_lo, b.contacts[k].x_lo) << what << ", contact " << k;
  }
  EXPECT_EQ(bits_of<D>(a.particles.x), bits_of<D>(b.particles.x)) << what;
  EXPECT_EQ(bits_of<D>(a.particles.v), bits_of<D>(b.particles.v)) << what;
  EXPECT_EQ(a.particles.spin, b.particles.spin) << what;
}

/// Spheres at random positions in a box, with radii in the given range.
template <int D>
std::unique_ptr<System<D>> random_system(int n, const Vec<D>& edges, std::array<Boundary, D> boundary, double smallest,
                                         double largest, std::uint64_t seed) {
  std::vector<double> radius(n), mass(n);
  for (int i = 0; i < n; ++i) {
    radius[i] = smallest * std::pow(largest / smallest, static_cast<double>(i) / std::max(n - 1, 1));
    mass[i] = std::pow(radius[i] / largest, D);
  }
  if (smallest == largest) mass.assign(n, 1.0);
  std::vector<Vec<D>> x(n, Vec<D>::Zero()), v(n, Vec<D>::Zero());
  auto system = test::make_system<D>(edges, P, x, v, radius, mass);
  system->box.boundary = boundary;
  std::vector<Id> ids(n);
  for (int i = 0; i < n; ++i) ids[i] = static_cast<Id>(i);
  EXPECT_EQ(insert_at_random<D>(system->box, system->particles.x, radius, ids, seed), ids.size());
  draw_velocities<D>(system->particles, ids, std::vector<double>(n, 1.0), seed);
  return system;
}

}  // namespace carom
