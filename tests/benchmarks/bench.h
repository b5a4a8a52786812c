// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The program carom_bench measures the speed of the event core and of the loops over pairs on this machine.
//
//   carom_bench --n 10000 --packing-fraction 0.49       bench_events(): collisions a second
//   carom_bench --curve                                 bench_curve(): the same of dilute to dense, and uneven gases
//   carom_bench --forces --potential yukawa             bench_forces(): pairs a second, steps a second
//
// Each state is built from a deck. Both functions print a table that grows row by row, and throw Error.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "io/deck/deck.h"

namespace carom::bench {

using Json = nlohmann::ordered_json;

constexpr std::uint64_t kSeed = 20240117;

struct Options {
  bool forces = false;           ///< measure forces instead of the event core
  bool curve = false;            ///< measure whole runs of gases from dilute to dense
  std::vector<std::uint64_t> n;  ///< empty: see sizes()
  std::uint64_t repeat = 3;      ///< measurements of each state
  std::filesystem::path json;    ///< file for all results; empty: none

  // Without `forces`:
  std::vector<double> packing_fraction{0.10, 0.30, 0.49};
  int dimension = 3;
  std::uint64_t equilibrate = 3;       ///< epochs of forty mean free times before
  std::uint64_t collisions = 1000000;  ///< of a measurement, at least; whole epochs are measured

  // With `forces`:
  std::vector<std::string> potential;  ///< a part of bench_potentials(); empty: all
  std::string kind;                    ///< "forces" or "mean forces"; empty: both
  std::uint64_t pairs = 20000000;      ///< of a measurement, at least; whole passes are measured
  std::uint64_t steps = 200;           ///< of a measurement of the melt; 0: none

  std::vector<std::uint64_t> sizes() const {
    if (!n.empty()) return n;
    if (forces) return {32000};
    return {1000, 10000, 100000, 1000000};
  }
};

/// The event core: periodic fluids of hard spheres, run by the free-flight integrator in epochs as in a normal run,
/// first to equilibrate and then, several times, to measure. The observables of a run (energies, overlaps, files) are
/// not measured.
void bench_events(const Options& options);

/// Whole runs of free flight without files: gases of equal spheres, of different sizes and masses, and with few spheres
/// that have most of the energy, at each packing fraction.
void bench_curve(const Options& options);

/// The potentials that bench_forces() measures.
std::vector<std::string> bench_potentials();

/// The loops over pairs: whole passes as in a run, over the pairs within the cutoff from an existing Verlet list; then
/// the velocity Verlet integrator in a Simulation that computes the energy after each step and makes new lists when
/// they are due. No files are written.
void bench_forces(const Options& options);

/// A deck from its text. Throws Error(Failure::deck).
Deck deck_of(const std::string& text);

/// Calls `work`; returns its wall time [s]. All measured work is called here: tools/count-instructions counts the
/// instructions of this function by its name.
double timed(const std::function<void()>& work);

/// Prints at once. Throws Error(Failure::file).
void say(const std::string& text);

/// The first lines of a table: version and compiler.
std::string title();

/// {median, min, max}
Json spread(std::vector<double> values);
/// "min .. max" in this unit, without decimals.
std::string range(const Json& spread, double unit = 1);

/// Writes {version, compiler, then `results`} to the file of --json, if there is one.
void store(const Options& options, const Json& results);

}  // namespace carom::bench
