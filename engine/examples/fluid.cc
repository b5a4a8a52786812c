// SPDX-License-Identifier: BSD-3-Clause
// A fluid of attractive hard spheres: its pressure and g(r).
//
//   ./fluid [PARTICLES]       hard cores of diameter 1, V = −Σ e^{−1.8 (r − 1)}/r up to r = 3

#include <carom/carom.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numeric>

int main(int count, char** arguments) {
  const std::size_t n = count > 1 ? std::strtoul(arguments[1], nullptr, 10) : 500;
  auto system = std::make_unique<carom::System<3>>();
  carom::Box<3>& box = system->box;
  box.edges.setConstant(carom::elementary::cbrt(static_cast<double>(n) / 0.6));
  box.boundary.fill(carom::Boundary::periodic);

  // A crystal that melts, with Maxwell–Boltzmann velocities.
  auto sites = carom::lattice_sites<3>(carom::Lattice::centred, box, n, 0);
  sites.resize(n);
  for (const auto& x : sites) system->particles.add({.x = x});
  std::vector<carom::Id> all(n);
  std::iota(all.begin(), all.end(), 0u);
  carom::draw_velocities<3>(system->particles, all, std::vector<double>(n, 1.5), /*seed*/ 1);
  add_interaction(*system, "yukawa", {{"amplitude", -carom::elementary::exp(1.8)}, {"kappa", 1.8}, {"cutoff", 3.0}});

  carom::Simulation<3> run(std::move(system), "edda", {{"step", 0.01}}, {.end_time = 3, .thermo_interval = 0.1});
  carom::RadialDistribution<3> rdf(run.system(), {.sampling = {.interval = 0.05, .start = 1}, .range = 3, .bins = 60});
  run.add(rdf);
  run.run();

  const carom::Statistics& s = run.statistics();
  std::printf("# energy error %.1e, pressure %.3f\n", s.max_energy_error / s.energy_reference, s.mean_pressure);
  std::printf("# r g(r)\n");
  const auto r = rdf.radii(), g = rdf.g();
  for (std::size_t k = 0; k < r.size(); ++k) std::printf("%.3f %.4f\n", r[k], g[k]);
}
