// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// `carom run`: from a deck to the files of a run.
//
// Rank 0 reads the deck for all. Where the integrator shares its work, every rank builds the same state and makes the
// same run, and rank 0 alone writes; where it does not, rank 0 does it all and the others sleep. All ranks end with the
// same exit code.
//
// What an earlier run left in the output directory is never overwritten: its files move to `backup.1`, `backup.2`, … in
// the same directory first, and the log says so. Other files there are left alone.

#include "io/deck/options.h"

namespace carom {

/// Runs the deck, or goes on with a run; returns the exit code: 0 done, 75 interrupted by a signal or `--max-wall`.
/// Throws Error: bad deck (2), impossible initial state (3), numerical failure (4), file trouble (5). What was written
/// before stays readable, and summary.json has the status. Must be called at most once in a process (it starts and ends
/// MPI).
int run_command(const RunOptions& options);

}  // namespace carom
