// SPDX-License-Identifier: BSD-3-Clause
// Five discs in a box, joined by springs: the first experiment of Enomoto's thesis, with exact energy.
//
//   ./five_springs            H = ½ Σ v² + ½ Σ (|x_i − x_i+1| − 2)²

#include <carom/carom.h>

#include <cstdio>

int main() {
  // 1. A box with hard walls, and particles.
  auto system = std::make_unique<carom::System<2>>();
  system->box.edges = {12, 6};
  for (int k = 0; k < 5; ++k) system->particles.add({.x = {2.0 + 2 * k, 3.0}, .radius = 0.5});
  system->particles.v[1] = {1.1, -0.4};
  system->particles.v[3] = {-0.7, 0.9};

  // 2. The interactions between them.
  add_interaction(*system, "harmonic-bond", {{"chain", true}, {"stiffness", 1.0}, {"rest_length", 2.0}});

  // 3. A run to t = 60.
  carom::Simulation<2> run(std::move(system), "edda", {{"step", 0.01}}, {.end_time = 60});
  run.run();

  // 4. Results.
  const carom::Statistics& s = run.statistics();
  std::printf("collisions %llu, energy error %.1e\n",
              static_cast<unsigned long long>(s.counters.sphere_sphere + s.counters.sphere_wall),
              s.max_energy_error / s.energy_reference);
  for (const auto& x : run.system().particles.x) std::printf("%.6f %.6f\n", x[0], x[1]);
}
