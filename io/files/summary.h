// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// summary.json: the outcome of a run, for scripts and tests. Written at the end, also for a run that failed or was
// stopped.

#include <filesystem>
#include <string>
#include <vector>

#include "engine/run/observable.h"
#include "io/deck/deck.h"

namespace carom {

/// Data for the summary that are not in the run's statistics.
struct RunOutcome {
  std::string status;                   ///< "done", "interrupted" (on request; can be continued), "failed"
  std::string error{};                  ///< why it failed; empty otherwise
  std::vector<std::string> warnings{};  ///< of the deck and of the run
  std::string branched_from{};          ///< the checkpoint that a branch started from; else empty
  std::size_t particles = 0;
  int ranks = 1;
  std::vector<SpeciesValue> species_values{};  ///< of the averages
  std::uint64_t peak_memory_bytes = 0;         ///< largest of all ranks; 0: that of this process
};

/// The summary as JSON text; names as in the manual. Values that a method does not have are null.
std::string summary_text(const Deck& deck, const RunOutcome& outcome, const Statistics& statistics);

}  // namespace carom
