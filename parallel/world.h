// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The ranks of a run: MPI started and ended with the life of one object.
//
//   World ranks(600);
//   return ranks.on_all([&] { return simulate(deck, exchange); });
//
// Works under mpirun and as a single process alike: one that no launcher has started is the only rank and starts no
// MPI, which would take longer than a small run. The engine knows nothing of it.

#include <mpi.h>

#include <functional>
#include <memory>

#include "parallel/watch.h"

namespace carom {

class World {
 public:
  /// Where a launcher (mpirun, srun) has started this process, starts MPI (MPI_THREAD_FUNNELED) and duplicates the
  /// world communicator. One object a process, once. `silence`: seconds after which ranks that work together give up
  /// those that do not answer, and after which a start or end of MPI that still waits ends the process; 0: never.
  explicit World(double silence = 0);
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  int rank() const { return rank_; }
  int size() const { return size_; }
  MPI_Comm handle() const { return world_; }
  /// To wait by; only where there are several ranks.
  Watch& watch() const { return *watch_; }

  /// Runs `work` on all ranks, which may communicate in it. Returns the exit code of all: what it returns, or that of
  /// the first failure. An exception is reported on stderr, once where all ranks meet the same Error, else with the
  /// names of the ranks; ranks that cannot be reached are ended (MPI_Abort).
  int on_all(const std::function<int()>& work) const;

  /// Runs `work` on rank 0, while the others sleep. Otherwise the same.
  int on_first(const std::function<int()>& work) const;

 private:
  MPI_Comm world_ = MPI_COMM_NULL;
  int rank_ = 0;
  int size_ = 1;
  double silence_;
  std::unique_ptr<Watch> watch_;
};

}  // namespace carom
