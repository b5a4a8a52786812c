// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The ranks of a run; one object starts MPI and, when destroyed, ends it.
//
//   World ranks(600);
//   return ranks.on_all([&] { return simulate(deck, exchange); });
//
// Works under mpirun and as a single process: without a launcher the process is the only rank and does not start MPI,
// which would take longer than a small run. The engine does not depend on it.

#include <mpi.h>

#include <functional>
#include <memory>

#include "parallel/watch.h"

namespace carom {

class World {
 public:
  /// If a launcher (mpirun, srun) started this process, starts MPI (MPI_THREAD_FUNNELED) and duplicates the world
  /// communicator. Only one object may exist in a process. `silence`: seconds after which ranks that do not answer
  /// count as lost, and after which the process ends if MPI cannot start or end; 0: never.
  explicit World(double silence = 0);
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  int rank() const { return rank_; }
  int size() const { return size_; }
  MPI_Comm handle() const { return world_; }
  /// Waits between ranks; requires several ranks.
  Watch& watch() const { return *watch_; }

  /// Runs `work` on all ranks, which may communicate in it. Returns the exit code of all: the value of `work`, or the
  /// code of the first failure. Exceptions are reported on stderr, once if all ranks meet the same Error, otherwise
  /// with the names of the ranks. Ranks that cannot be reached are ended (MPI_Abort).
  int on_all(const std::function<int()>& work) const;

  /// Like on_all(), but runs `work` on rank 0 while the other ranks sleep.
  int on_first(const std::function<int()>& work) const;

 private:
  MPI_Comm world_ = MPI_COMM_NULL;
  int rank_ = 0;
  int size_ = 1;
  double silence_;
  std::unique_ptr<Watch> watch_;
};

}  // namespace carom
