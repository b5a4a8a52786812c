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

/// A wall, for the numbers of its contacts.
struct WallRecord {
  Id number = 0;
  std::string name;
  double area = 0;  ///< Box::area() at the end of the run [length^(D−1)]

  /// The walls of a box.
  template <int D>
  static std::vector<WallRecord> all(const Box<D>& box) {
    std::vector<WallRecord> records;
    for (const Wall<D>& wall : box.walls())
      records.push_back({wall.number, box.name_of(wall.number), box.area(wall, box.time)});
    return records;
  }
};

/// Data for the summary that are not in the run's statistics.
struct RunOutcome {
  std::string status;                   ///< "done", "interrupted" (on request; can be continued), "failed"
  std::string error{};                  ///< why it failed; empty otherwise
  std::vector<std::string> warnings{};  ///< about the deck and the run
  std::string branched_from{};          ///< the checkpoint that a branch started from; else empty
  std::size_t particles = 0;
  int ranks = 1;
  std::vector<SpeciesValue> species_values{};  ///< from the averages
  std::vector<WallRecord> walls{};
  std::uint64_t peak_memory_bytes = 0;  ///< largest of all ranks; 0: that of this process
};

/// The summary as JSON text; names as in the manual. Values that a method does not have are null.
std::string summary_text(const Deck& deck, const RunOutcome& outcome, const Statistics& statistics);

}  // namespace carom
