// SPDX-License-Identifier: BSD-3-Clause
// Hard spheres in free flight on several ranks, which are threads of this process: how many instructions ranks execute,
// without those of waiting for messages. See tests/benchmarks/README.md.
//
//   carom_ranks_bench RANKS SPHERES PACKING_FRACTION COLLISIONS

#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <numeric>

#include "engine/base/elementary.h"
#include "engine/run/simulation.h"
#include "engine/setup/placement.h"
#include "tests/support/thread_ranks.h"

int main(int arguments, char** argument) {
  using namespace carom;
  if (arguments != 5) {
    std::fprintf(stderr, "usage: %s RANKS SPHERES PACKING_FRACTION COLLISIONS\n", argument[0]);
    return 2;
  }
  const std::size_t n = std::strtoul(argument[2], nullptr, 10);
  const double filled = std::strtod(argument[3], nullptr);
  const std::uint64_t collisions = std::strtoull(argument[4], nullptr, 10);
  test::ThreadRanks(std::atoi(argument[1])).run([&](Communicator& ranks) {
    auto system = std::make_unique<System<3>>();
    system->box.edges.setConstant(elementary::cbrt(static_cast<double>(n) * std::numbers::pi / 6 / filled));
    system->box.boundary.fill(Boundary::periodic);
    for (const auto& x : lattice_sites<3>(Lattice::centred, system->box, n, 0)) system->particles.add({.x = x});
    std::vector<Id> all(n);
    std::iota(all.begin(), all.end(), Id{0});
    draw_velocities<3>(system->particles, all, std::vector<double>(n, 1.0), 1);
    if (ranks.size() > 1) system->decomposition.join(ranks);
    Simulation<3> run(std::move(system), "free-flight", {}, {.collisions = collisions});
    run.run();
    const WindowCounts& windows = run.statistics().counters.windows;
    std::printf("rank %d: %llu windows, %llu rounds, %llu events run\n", ranks.rank(),
                static_cast<unsigned long long>(windows.windows), static_cast<unsigned long long>(windows.rounds),
                static_cast<unsigned long long>(windows.run_events));
  });
}
