// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// What stands in run.log beside the warnings: the banner, the thermo table, the final report with the timing breakdown.

#include <optional>
#include <span>
#include <string>

#include "engine/integrators/integrator.h"
#include "engine/run/simulation.h"
#include "io/deck/deck.h"
#include "io/files/log.h"
#include "io/files/rank_account.h"

namespace carom {

/// Version, libraries, host, deck and method of a run. `particles`: their number; `ranks`: of MPI.
std::string banner_text(const Deck& deck, std::size_t particles, int ranks);

/// The warning of a run with energy errors beyond the energy itself, from a step far too long, or beyond 1e-12 of it
/// with an exact method; else nothing.
std::optional<std::string> energy_warning(const Statistics& statistics, const IntegratorInfo& method);

/// How the run ended, what it found and where the time of the ranks went: of several, least, mean and most.
std::string report_text(const Deck& deck, const Statistics& statistics, std::span<const RankAccount> ranks);

/// Writes thermo rows into the log as a table for people: the first 32, then 16 of each doubling of their number
/// (a million rows leave 270), and the last. The choice depends on the number of a row alone, so that a run that was
/// interrupted has the same table.
template <int D>
class ThermoTable : public Observer<D> {
 public:
  /// `rows`: so many have been shown to the table before.
  explicit ThermoTable(RunLog& log, std::uint64_t rows = 0) : log_(log), rows_(rows) {}
  void thermo(const Snapshot<D>& snapshot) override;
  /// How many have been shown to it.
  std::uint64_t rows() const { return rows_; }
  /// Writes the last row, unless it is there.
  void finish();

 private:
  void write(const Snapshot<D>& snapshot);
  RunLog& log_;
  std::uint64_t rows_;
  std::optional<Snapshot<D>> left_out_;  // the last row, where it was
};

}  // namespace carom
