// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The contents of run.log besides the warnings: the banner, the thermo table, the final report with the timing
// breakdown.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/integrators/integrator.h"
#include "engine/run/simulation.h"
#include "io/deck/deck.h"
#include "io/files/log.h"
#include "io/files/rank_account.h"

namespace carom {

/// "step 0.01", or that the method chooses its steps.
std::string steps_text(const Plan& plan);
/// Version, libraries, host, deck and method of a run. `particles`: their number; `ranks`: of MPI.
std::string banner_text(const Deck& deck, std::size_t particles, int ranks);

/// A warning if the energy error exceeds the energy itself (the step is far too long), or 1e-12 of it with an exact
/// method.
std::optional<std::string> energy_warning(const Statistics& statistics, const IntegratorInfo& method);
/// Warns of steps that were so long that positions were wrong by a hundredth of a diameter in one of them: where the
/// energy is exact at any step, it does not tell.
std::optional<std::string> accuracy_warning(const Statistics& statistics, const IntegratorInfo& method);
/// A warning if spheres overlapped by more than rounding, in the run so far.
template <int D>
std::optional<std::string> overlap_warning(const Statistics& statistics, const Box<D>& box);
/// These three warnings, as far as they apply.
template <int D>
std::vector<std::string> warnings_about(const Statistics& statistics, const IntegratorInfo& method, const Box<D>& box);
/// All warnings at the end of a run: these, and if no end of the initial transient was found that means were to begin
/// at.
template <int D>
std::vector<std::string> warnings_about(const Deck& deck, const Statistics& statistics, const Box<D>& box);

/// How the run ended, its results, and the time spent by part: least, mean and most of several ranks.
std::string report_text(const Deck& deck, const Statistics& statistics, std::span<const RankAccount> ranks);

/// Writes thermo rows into the log as a readable table: the first 32, then 16 of each doubling of their number
/// (a million rows leave 270), and the last. The choice depends only on the index of a row, so that an interrupted and
/// continued run has an identical table.
template <int D>
class ThermoTable : public Observer<D> {
 public:
  /// `rows`: the number of rows passed to the table before.
  explicit ThermoTable(RunLog& log, std::uint64_t rows = 0) : log_(log), rows_(rows) {}
  void thermo(const Snapshot<D>& snapshot) override;
  /// The number of rows passed to the table.
  std::uint64_t rows() const { return rows_; }
  /// Writes the last row, unless it is in the table already.
  void finish();

 private:
  void write(const Snapshot<D>& snapshot);
  RunLog& log_;
  std::uint64_t rows_;
  std::optional<Snapshot<D>> left_out_;  // the last row, if it was left out
};

}  // namespace carom
