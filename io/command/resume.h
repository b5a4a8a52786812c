// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// What a run goes on from: the checkpoint of a run that is continued, or of one that another branches off.
//
//   Resumed from = find_run(directory, false, ranks);           Resumed from = find_state(checkpoint, output, ranks);
//   Deck deck = deck_of(from, options, ranks);
//   GivenState given = state_of<2>(from, deck);   // for build_system()
//   set_hooks(from, deck, simulation, hooks);
//   simulation.run(hooks);

#include <memory>
#include <optional>
#include <string>

#include "io/deck/options.h"
#include "io/files/checkpoint.h"
#include "io/files/directory_lock.h"
#include "io/files/thermo.h"

namespace carom {

/// The checkpoint on rank 0, and what all ranks know of it.
struct Resumed {
  std::filesystem::path directory;  ///< where it was found
  /// Of a run that is continued: goes to the run. Taken before the checkpoint is read: a process that is ending may
  /// write another.
  std::unique_ptr<DirectoryLock> lock;
  std::optional<Checkpoint> checkpoint;
  CheckpointHead head;
  std::string warning;     ///< about a later checkpoint that is damaged
  StepCount count;         ///< by which its steps are counted
  ThermoPoint reached;     ///< how far a run that is continued has come
  std::optional<Deck> of;  ///< of a branch: the deck of the run that it branches off
  bool same_motion = false;

  bool is_branch() const { return of.has_value(); }
  bool is_continued() const { return !is_branch(); }
  StateReader reader() const;
};

/// The last checkpoint of a run that is to be continued. Throws Error(Failure::file). Collective.
Resumed find_run(const std::filesystem::path& directory, bool take_over, Communicator& ranks);

/// What a branch is to start from: a checkpoint, or the last good one in a directory. `output`: of the branch. Throws
/// Error(Failure::file), Error(Failure::deck) where the output is that of the run itself. Collective.
Resumed find_state(const std::filesystem::path& checkpoint, const std::filesystem::path& output, Communicator& ranks);

/// The deck of a run that is continued, where only the end may be another, or of a branch. Throws Error(Failure::deck).
Deck deck_of(Resumed& from, const RunOptions& options, Communicator& ranks);

/// The state that the run of this deck starts from; `from` must outlive
/// it. Throws Error(Failure::deck) where a branch would have nothing to do. Collective.
template <int D>
GivenState state_of(Resumed& from, const Deck& deck);

/// Sets restore and branch.
template <int D>
void set_hooks(const Resumed& from, const Deck& deck, Simulation<D>& simulation, typename Simulation<D>::Hooks& hooks);

}  // namespace carom
