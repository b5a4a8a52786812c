// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// summary.json: the outcome of a run, for scripts and tests. Written at the end, also of a run that failed or was
// stopped.

#include <filesystem>
#include <string>
#include <vector>

#include "engine/run/observable.h"
#include "io/deck/deck.h"

namespace carom {

/// What the run's statistics do not know.
struct RunOutcome {
  std::string status;                   ///< "done", "interrupted" (on request; can be continued), "failed"
  std::string error{};                  ///< why it failed; empty otherwise
  std::vector<std::string> warnings{};  ///< of the deck and of the run
  std::string branched_from{};          ///< the checkpoint that a branch started from; else empty
  std::size_t particles = 0;
  int ranks = 1;
  std::vector<SpeciesValue> species_values{};  ///< of the averages
  std::uint64_t peak_memory_bytes = 0;         ///< of a rank, at most; 0: of this one
};

/// The summary as JSON text; names as in the manual. What a method does not have is null.
std::string summary_text(const Deck& deck, const RunOutcome& outcome, const Statistics& statistics);

}  // namespace carom
