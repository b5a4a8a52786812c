// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// What a run starts from: the checkpoint of the run that it continues, or of the run that it branches off.
//
//   Resumed from = find_run(directory, false, ranks);           Resumed from = find_state(checkpoint, output, ranks);
//   Deck deck = deck_of(from, options, ranks);
//   GivenState given = state_of<2>(from, deck);   // for build_system()
//   set_hooks(from, deck, simulation, hooks);
//   simulation.run(hooks);

#include <map>
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
  /// The lock of a continued run, later moved to the run. It is acquired before the checkpoint is read, since a process
  /// that is ending may write another checkpoint.
  std::unique_ptr<DirectoryLock> lock;
  std::optional<Checkpoint> checkpoint;
  CheckpointHead head;
  std::string warning;               ///< about a later checkpoint that is damaged
  StepCount count;                   ///< how its steps are counted
  ThermoPoint reached;               ///< the point that the run has reached
  std::optional<Deck> of;            ///< for a branch: the deck of the run that it branches off
  std::map<std::string, Bytes> end;  ///< for a branch: the state at the end of that run, if that is not the checkpoint
  bool same_motion = false;

  bool is_branch() const { return of.has_value(); }
  bool is_continued() const { return !is_branch(); }
  StateReader reader() const;
};

/// The last checkpoint of the run to be continued. Throws Error(Failure::file). Collective.
Resumed find_run(const std::filesystem::path& directory, bool take_over, Communicator& ranks);

/// The state a branch starts from: a checkpoint, or the last good one in a directory; go_to_end() may follow. `output`:
/// directory of the branch. Throws Error(Failure::file), or Error(Failure::deck) if `output` is the directory of the
/// run itself. Collective.
Resumed find_state(const std::filesystem::path& checkpoint, const std::filesystem::path& output, Communicator& ranks);

/// The deck of a continued run, of which only the end may change, or of a branch. Throws Error(Failure::deck).
Deck deck_of(Resumed& from, const RunOptions& options, Communicator& ranks);

/// For a branch off the directory of a run that has ended: computes the state at its end, where `from` then is. The
/// checkpoint is from before the last step or epoch, which the end of the run has shortened. Collective.
template <int D>
void go_to_end(Resumed& from, Communicator& ranks);

/// The state that the run of this deck starts from; `from` must outlive it. Throws Error(Failure::deck) if a branch
/// would have nothing to do. Collective.
template <int D>
GivenState state_of(Resumed& from, const Deck& deck);

/// Sets the hooks `restore` and `branch`.
template <int D>
void set_hooks(const Resumed& from, const Deck& deck, Simulation<D>& simulation, typename Simulation<D>::Hooks& hooks);

}  // namespace carom
