// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A deck, a system and snapshots made by hand, for the tests of the writers.

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "io/deck/deck.h"

namespace carom::test {

/// An empty directory for each test.
inline std::filesystem::path fresh_directory() {
  const auto* test = testing::UnitTest::GetInstance()->current_test_info();
  const auto path = std::filesystem::path(testing::TempDir()) /
                    (std::string("carom.") + test->test_suite_name() + "." + test->name());
  std::filesystem::remove_all(path);
  std::filesystem::create_directories(path);
  return path;
}

inline Deck sample_deck(int dimension) {
  Deck deck;
  deck.file = "sample.toml";
  deck.title = "three spheres";
  deck.dimension = dimension;
  deck.integrator = "free-flight";
  deck.toml_text = "format = 1\n";
  deck.plan.step = 0.5;
  deck.plan.steps = 10;
  return deck;
}

/// Three particles of two species in a box of edges 4, 5(, 6); x_i = (i, i + 1/4(, i + 1/2)), v_i = −x_i, image_i = i.
template <int D>
std::unique_ptr<System<D>> sample_system() {
  auto system = std::make_unique<System<D>>();
  system->species = {"small", "large"};
  for (int k = 0; k < D; ++k) system->box.edges[k] = 4 + k;
  system->box.boundary[0] = Boundary::periodic;
  Particles<D>& p = system->particles;
  for (int i = 0; i < 3; ++i) {
    Vec<D> x;
    Image<D> image;
    for (int k = 0; k < D; ++k) {
      x[k] = i + 0.25 * k;
      image[static_cast<std::size_t>(k)] = i;
    }
    p.x.push_back(x);
    p.v.push_back(-x);
    p.image.push_back(image);
    p.mass.push_back(1.5 + i);
    p.radius.push_back(0.1);
    p.charge.push_back(-i);
    p.species.push_back(i == 2);
  }
  return system;
}

template <int D>
Snapshot<D> sample_snapshot(const Particles<D>& particles, double time, std::int64_t step) {
  Snapshot<D> s;
  s.time = time;
  s.step = step;
  s.collisions = static_cast<std::uint64_t>(3 * step);
  s.particles = &particles;
  s.kinetic = 2.5;
  s.potential = -1.25;
  s.momentum.fill(0.5);
  s.temperature = 1.0 / 3;
  s.pressure = 0.1;
  return s;
}

}  // namespace carom::test
