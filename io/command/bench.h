// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// `carom bench`: how fast the event core is on this machine; `--forces`: the loops over pairs (bench_forces.h).
//
// Every point of the table is a periodic fluid of hard spheres, run by the free-flight integrator slab after slab as a
// run does it, first to equilibrate and then, a number of times, to measure. Slabs are whole epochs, so the cost of
// their beginnings is in the figures with its true share; the observables of a run (energies, overlaps, files) are not.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace carom {

struct BenchOptions {
  bool forces = false;           ///< measure forces instead of the event core
  std::vector<std::uint64_t> n;  ///< empty: see sizes()
  std::vector<double> packing_fraction{0.10, 0.30, 0.49};
  int dimension = 3;
  std::optional<std::uint64_t> equilibrate;         ///< epochs of forty mean free times before; default epochs_before()
  std::uint64_t collisions = 1000000;               ///< of a measurement, at least: whole epochs are measured
  std::uint64_t repeat = 3;                         ///< measurements a point, one after the other
  std::optional<std::filesystem::path> json;        ///< all results, for scripts
  std::optional<std::filesystem::path> state;       ///< measure this state instead of the table
  std::optional<std::filesystem::path> save_state;  ///< write the equilibrated state of the only point here

  // With `forces`:
  std::vector<std::string> potential;  ///< these of bench_potentials(); empty: all
  std::optional<std::string> kind;     ///< "forces" or "mean forces"; absent: both
  std::uint64_t pairs = 20000000;      ///< of a measurement, at least: whole passes are measured
  std::uint64_t steps = 200;           ///< of a measurement of the melt; 0: none

  static constexpr std::uint64_t kWarmUp = 1;  ///< epochs of the measured core before it is measured
  std::vector<std::uint64_t> sizes() const {
    if (!n.empty()) return n;
    if (forces) return {32000};
    return {1000, 10000, 100000, 1000000};
  }
  std::uint64_t epochs_before() const { return equilibrate.value_or(state ? 0 : 3); }
};

/// Prints the table as it grows; returns the exit code of the process. Throws Error.
int bench_command(const BenchOptions& options);

}  // namespace carom
