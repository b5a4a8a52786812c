// SPDX-License-Identifier: BSD-3-Clause
// Search cells: the cell of a sphere, the spheres near it, and the table of all cells.

#include <benchmark/benchmark.h>

#include "engine/search/sized_cells.h"
#include "tests/support/experiments.h"

namespace carom {
namespace {

constexpr double kPackingFraction = 0.3, kDiameter = 1;

/// A lattice of 4·cells³ spheres (2-D: 2·cells² discs).
template <int D>
std::unique_ptr<System<D>> lattice(const benchmark::State& state) {
  return test::hard_spheres<D>(static_cast<int>(state.range(0)), kPackingFraction);
}

template <int D>
void cell_of(benchmark::State& state) {
  const auto system = lattice<D>(state);
  const auto& x = system->particles.x;
  const CellGrid<D> grid(system->box, kDiameter, Extent<D>(x));
  for (auto _ : state)
    for (const auto& place : x) benchmark::DoNotOptimize(grid.index(grid.cell(place)));
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(x.size()));
}
BENCHMARK(cell_of<2>)->Arg(64);
BENCHMARK(cell_of<3>)->Arg(13);

/// The 3^D cells around each sphere, in ranges; empty visits.
template <int D>
void cells_around(benchmark::State& state) {
  const auto system = lattice<D>(state);
  const auto& x = system->particles.x;
  const CellGrid<D> grid(system->box, kDiameter, Extent<D>(x));
  Cell<D> range;
  range.fill(1);
  for (auto _ : state)
    for (const auto& place : x)
      grid.for_each_range(grid.cell(place), range, false, [](std::size_t first, std::size_t, const Image<D>& away) {
        benchmark::DoNotOptimize(first);
        benchmark::DoNotOptimize(away);
      });
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(x.size()));
}
BENCHMARK(cells_around<2>)->Arg(64);
BENCHMARK(cells_around<3>)->Arg(13);

template <int D>
void sized_cells(benchmark::State& state) {
  const auto system = lattice<D>(state);
  const auto& x = system->particles.x;
  const std::vector<double> reach(x.size(), kDiameter / 2);
  for (auto _ : state) {
    SizedCells<D> cells(system->box, reach, Extent<D>(x));
    for (Id i = 0; i < x.size(); ++i) cells.insert(i, x[i], reach[i]);
    benchmark::DoNotOptimize(&cells);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(x.size()));
}
BENCHMARK(sized_cells<2>)->Arg(64);
BENCHMARK(sized_cells<3>)->Arg(13)->Arg(29)->Arg(63);

}  // namespace
}  // namespace carom
