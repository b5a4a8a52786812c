// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Everything that a run writes to its directory, from its lock to its summary.
//
//   RunRecord<D> record(deck, simulation, {});
//   simulation.run({.should_stop = [&] { record.checkpoint(); return false; }});
//   record.close();                                            // or fail(error) if the run has thrown

#include <memory>
#include <string>
#include <vector>

#include "io/files/checkpoint.h"
#include "io/files/directory_lock.h"
#include "io/files/log.h"
#include "io/files/log_report.h"
#include "io/files/run_files.h"
#include "io/files/summary.h"

namespace carom {

/// Where a run comes from, the ranks that work on it, and what the terminal shows.
struct RecordOptions {
  const CheckpointHead* from = nullptr;   ///< the checkpoint that the run continues, or branches off
  bool continued = false;                 ///< it continues
  std::string warning{};                  ///< about that checkpoint
  std::unique_ptr<DirectoryLock> lock{};  ///< of the directory; null: the record acquires it
  Communicator* at_work = nullptr;        ///< the ranks that share the work; null: this one alone
  int ranks = 1;                          ///< the number of all ranks
  bool silent = false, quiet = false;     ///< nothing, or only warnings, on the terminal
};

/// The record of a run, on rank 0.
template <int D>
class RunRecord {
 public:
  /// Locks the directory and creates the files, or opens the files of the same run again to continue from a checkpoint;
  /// if a file belongs to another run, nothing is changed. Adds the files to the observers of the run. All arguments
  /// outlive the record. Throws Error(Failure::file).
  RunRecord(const Deck& deck, Simulation<D>& simulation, RecordOptions options);

  /// The head of a checkpoint at this time. To be called in Simulation::Hooks::should_stop.
  CheckpointHead head();
  /// Writes checkpoint.h5, from which the command or another record can continue. To be called there, too. Throws
  /// Error(Failure::file).
  CheckpointHead checkpoint();
  /// Ends the record of a run that has finished or was stopped; `last` is its last message. Throws
  /// Error(Failure::file). Collective.
  void close(const std::string& last = {});
  /// Ends the record of a failed run and ignores further errors.
  void fail(const std::string& why);

  const RunFiles<D>& files() const { return *files_; }
  /// Warnings about the directory, and about the run once the record is closed.
  const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  void warn(const std::string& text);
  void write_summary();

  const Deck& deck_;
  Simulation<D>& simulation_;
  RecordOptions options_;
  std::vector<std::string> warnings_;
  std::unique_ptr<RunLog> log_;
  std::unique_ptr<RunFiles<D>> files_;
  std::unique_ptr<ThermoTable<D>> table_;
  std::vector<PairList> bonds_;
  RunOutcome outcome_;
};

}  // namespace carom
