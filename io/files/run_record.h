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

/// The record of a run on one rank, without messages on the terminal.
template <int D>
class RunRecord {
 public:
  /// Locks the directory and creates the files, or opens the files of the same run again to continue from a checkpoint;
  /// if a file belongs to another run, nothing is changed. Adds the files to the observers of the run. All arguments
  /// but the deck outlive the record. Throws Error(Failure::file).
  RunRecord(Deck deck, Simulation<D>& simulation, const CheckpointHead* continued);

  /// Writes checkpoint.h5, from which the command or another record can continue. To be called in
  /// Simulation::Hooks::should_stop. Throws Error(Failure::file).
  CheckpointHead checkpoint();
  /// Ends the record of a run that has finished or was stopped. Throws Error(Failure::file).
  void close();
  /// Ends the record of a failed run and ignores further errors.
  void fail(const std::string& why);

  const RunFiles<D>& files() const { return *files_; }
  /// Warnings about the directory, and about the run once the record is closed.
  const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  CheckpointHead head();
  void warn(const std::string& text);
  void write_summary();

  Deck deck_;
  Simulation<D>& simulation_;
  DirectoryLock lock_;
  std::vector<std::string> warnings_;
  std::unique_ptr<RunLog> log_;
  std::unique_ptr<RunFiles<D>> files_;
  std::unique_ptr<ThermoTable<D>> table_;
  std::vector<PairList> bonds_;
  RunOutcome outcome_;
};

}  // namespace carom
