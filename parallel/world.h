// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The ranks of a run; one object starts MPI and, when destroyed, ends it.
//
//   World ranks(600);
//   return ranks.on_all([&] { return simulate(deck, ranks.communicator()); });
//
// Works under mpirun and as a single process: without a launcher the process is the only rank and does not start MPI,
// which would take longer than a small run. Neither the engine nor this header depends on MPI.

#include <functional>
#include <memory>
#include <stdexcept>
#include <string>

#include "engine/ranks/communicator.h"

namespace carom {

/// Another rank has failed; the message names it.
class RankFailure : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Some ranks do not answer; the message names them.
class SilentRanks : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Exit code for faults that are not errors of the deck or files: bugs, lack of memory, lost ranks.
constexpr int kFault = 70;

/// The end of a rank's work.
struct Outcome {
  int code = 0;
  std::string failure{};  ///< why it failed; empty if it did not
  bool left = false;      ///< it left a call in which it waited for other ranks
};

/// The processes of a launcher (mpirun, srun).
class Team {
 public:
  virtual ~Team() = default;
  virtual Communicator& communicator() = 0;
  /// Watch::finish().
  virtual int finish(const Outcome& mine, bool alone) = 0;
};

// mpi_team.cc, or without MPI (CAROM_MPI=OFF) one_rank.cc, defines these two.
/// Starts MPI if a launcher started this process; else returns null. Without MPI, throws Error(Failure::deck) in one of
/// several processes. `silence`: as in World.
std::unique_ptr<Team> start_team(double silence);
std::string mpi_version();

class World {
 public:
  /// Only one object may exist in a process. `silence`: seconds after which ranks that do not answer count as lost, and
  /// after which the process ends if MPI cannot start or end; 0: never.
  explicit World(double silence = 0) : team_(start_team(silence)) {}

  int rank() const { return communicator().rank(); }
  int size() const { return communicator().size(); }
  Communicator& communicator() const {
    return team_ && team_->communicator().size() > 1 ? team_->communicator() : alone_;
  }

  /// Runs `work` on all ranks, which may communicate in it. Returns the exit code of all: the value of `work`, or the
  /// code of the first failure. Exceptions are reported on stderr, once if all ranks meet the same Error, otherwise
  /// with the names of the ranks. Ranks that cannot be reached are ended (MPI_Abort).
  int on_all(const std::function<int()>& work) const;

  /// Like on_all(), but runs `work` on rank 0 while the other ranks sleep.
  int on_first(const std::function<int()>& work) const;

 private:
  mutable Communicator alone_;
  std::unique_ptr<Team> team_;
};

}  // namespace carom
