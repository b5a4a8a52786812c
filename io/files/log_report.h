#pragma once
// What stands in run.log beside the warnings: the banner, the thermo table, the final report with the timing breakdown.

#include <span>
#include <string>

#include "engine/run/simulation.h"
#include "io/deck/deck.h"
#include "io/files/log.h"
#include "io/files/rank_account.h"

namespace carom {

/// Version, libraries, host, deck and method of a run. `particles`: their number; `ranks`: of MPI.
std::string banner_text(const Deck& deck, std::size_t particles, int ranks);

/// How the run ended, what it found and where the time of the ranks went: of several, least, mean and most.
std::string report_text(const Deck& deck, const Statistics& statistics, std::span<const RankAccount> ranks);

/// Writes thermo rows into the log as a table for human eyes.
template <int D>
class ThermoTable : public Observer<D> {
 public:
  explicit ThermoTable(RunLog& log) : log_(log) {}
  void thermo(const Snapshot<D>& snapshot) override;

 private:
  RunLog& log_;
  bool header_written_ = false;
};

}  // namespace carom
