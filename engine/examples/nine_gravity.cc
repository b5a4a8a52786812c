// SPDX-License-Identifier: BSD-3-Clause
// Nine discs in a box that attract each other like point masses in 3-D: the second experiment of Enomoto's thesis, with
// every integrator that handles forces.
//
//   ./nine_gravity [STEP]     H = ½ Σ v² − Σ 1/|x_i − x_j|

#include <carom/carom.h>

#include <cstdio>
#include <cstdlib>

namespace {

std::unique_ptr<carom::System<2>> nine_discs() {
  auto system = std::make_unique<carom::System<2>>();
  system->box.edges = {10, 10};
  const double v[9][2] = {{0.2899, 0.2899}, {0, 0.52},         {-0.2616, 0.2616}, {0.61, 0},         {0, 0},
                          {-0.45, 0},       {0.4101, -0.4101}, {0, -0.33},        {-0.3465, -0.3465}};
  for (int k = 0; k < 9; ++k)
    system->particles.add({.x = {2.5 + 2.5 * (k % 3), 2.5 + 2.5 * (k / 3)}, .v = {v[k][0], v[k][1]}, .radius = 0.5});
  add_interaction(*system, "gravity", {{"constant", 1.0}});
  return system;
}

}  // namespace

int main(int count, char** arguments) {
  const double step = count > 1 ? std::atof(arguments[1]) : 0.01;
  try {
    for (const char* method : {"psa", "cva", "mcva", "cdda", "edda"}) {
      carom::Simulation<2> run(nine_discs(), method, {{"step", step}}, {.end_time = 3});
      run.run();
      const carom::Statistics& s = run.statistics();
      std::printf("%-5s energy error %.1e, force passes %.0f\n", method, s.max_energy_error / s.energy_reference,
                  s.force_passes);
    }
  } catch (const carom::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return error.exit_code();
  }
}
