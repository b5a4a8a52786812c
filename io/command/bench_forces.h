// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// `carom bench --forces`: how fast the loop over pairs is on this machine, and a run that consists of little else.
//
// Pairs a second: whole passes as a run makes them, from a Verlet list that is there already, over the pairs within the
// cutoff. Steps a second: the velocity Verlet integrator in a Simulation that measures the energy after each step and
// makes new lists when they are due; no files are written.

#include <string>
#include <vector>

#include "io/command/bench.h"

namespace carom {

/// The potentials there are figures of.
std::vector<std::string> bench_potentials();

/// Prints the tables as they grow. Throws Error.
void bench_forces(const BenchOptions& options);

}  // namespace carom
