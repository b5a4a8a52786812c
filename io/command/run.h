// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// `carom run`: from a deck to the files of a run.
//
// Rank 0 reads the deck for all ranks. If the integrator shares its work, every rank builds the same state and makes
// the same run, and only rank 0 writes; if not, rank 0 does everything and the other ranks sleep. All ranks end with
// the same exit code.
//
// The files of an earlier run in the output directory are never overwritten: they move to `backup.1`, `backup.2`, … in
// the same directory first, and the log says so. Other files there are left alone.

#include "io/deck/options.h"

namespace carom {

/// Runs the deck, or continues a run; returns the exit code: 0 done, 75 interrupted by a signal or `--max-wall`.
/// Throws Error: bad deck (2), impossible initial state (3), numerical failure (4), file trouble (5). Files written
/// before an error stay readable, and summary.json has the status. Must be called at most once in a process (it starts
/// and ends MPI).
int run_command(const RunOptions& options);

}  // namespace carom
