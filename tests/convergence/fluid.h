// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Fluids for the tests against the literature: they melt at once and are measured with error bars.

#include <array>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "engine/base/random.h"
#include "engine/setup/placement.h"
#include "tests/convergence/literature.h"
#include "tests/support/experiments.h"

namespace carom::test {

/// About n hard spheres (discs) of diameter 1 at this packing fraction and temperature 1, on random sites of a lattice
/// close to the densest one: with so many vacancies it melts within a few collisions per particle. (A perfect fcc
/// crystal can be metastable for long at packing fraction 0.49.)
template <int D>
std::unique_ptr<System<D>> molten(std::size_t about, double eta, unsigned seed) {
  const double densest = D == 3 ? 0.70 : 0.86, ball = D == 3 ? std::numbers::pi / 6 : std::numbers::pi / 4;
  const double in_cell = D == 3 ? 4 : 2;
  const double cells = std::round(std::pow(static_cast<double>(about) * densest / eta / in_cell, 1.0 / D));
  const auto sites = static_cast<std::size_t>(in_cell * std::pow(cells, D));
  const auto n = static_cast<std::size_t>(static_cast<double>(sites) * eta / densest);
  Box<D> box;
  box.edges = commensurate_edges<D>(Lattice::centred, sites, static_cast<double>(n) * ball / eta);
  box.boundary.fill(Boundary::periodic);
  auto x = lattice_sites<D>(Lattice::centred, box, sites, 0.0);
  RandomStream random(seed, RandomPurpose::position, 0);
  for (std::size_t i = 0; i < n; ++i) std::swap(x[i], x[i + random.below(static_cast<std::uint32_t>(x.size() - i))]);
  x.resize(n);
  auto system = make_system<D>(box.edges, Boundary::periodic, std::move(x), std::vector<Vec<D>>(n, Vec<D>::Zero()));
  std::vector<Id> all(n);
  for (Id i = 0; i < n; ++i) all[i] = i;
  draw_velocities<D>(system->particles, all, std::vector<double>(n, 1.0), seed);
  return system;
}

/// A mean and its standard error.
struct Mean {
  double value, error;
};

/// From the means of `blocks` blocks of y[first …], which must be much longer than all correlations.
inline Mean blocked_mean(const std::vector<double>& y, std::size_t first, std::size_t blocks = 20) {
  const std::size_t length = (y.size() - first) / blocks;
  double sum = 0, squares = 0;
  for (std::size_t b = 0; b < blocks; ++b) {
    double mean = 0;
    for (std::size_t k = 0; k < length; ++k) mean += y[first + b * length + k] / static_cast<double>(length);
    sum += mean, squares += mean * mean;
  }
  const auto n = static_cast<double>(blocks);
  return {sum / n, std::sqrt(std::max(0.0, squares / n - sum * sum / (n * n)) / (n - 1))};
}

/// Records Z and the collision rate between rows of the thermo table.
///
/// The total momentum is zero, so that K = D(N − 1)kT/2; with this T relative velocities have the canonical
/// distribution: Z = 1 + Σ d·impulse/(D N kT Δt). The pressure of a row has 2K/(D V) for the ideal gas.
template <int D>
struct FluidRows : Observer<D> {
  void thermo(const Snapshot<D>& shot) override {
    const auto n = static_cast<double>(shot.particles->size());
    if (shot.collisions > before_) {
      const double temperature = 2 * shot.kinetic / (D * (n - 1));
      z.push_back(1 + (shot.pressure * volume - 2 * shot.kinetic / D) / (n * temperature));
      rate.push_back(2 * static_cast<double>(shot.collisions - before_) / (n * (shot.time - time_)) /
                     std::sqrt(temperature));
    }
    before_ = shot.collisions, time_ = shot.time;
  }
  explicit FluidRows(double v) : volume(v) {}
  double volume;
  std::vector<double> z, rate;

 private:
  std::uint64_t before_ = 0;
  double time_ = 0;
};

/// The number of collisions of a slow test; CAROM_SLOW_COLLISIONS overrides it.
inline std::uint64_t slow_collisions(double usual) {
  const char* given = std::getenv("CAROM_SLOW_COLLISIONS");
  return static_cast<std::uint64_t>(given ? std::atof(given) : usual);
}

}  // namespace carom::test
