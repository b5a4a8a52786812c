#pragma once
// The ranks of a run: MPI started and ended with the life of one object, and rules for how ranks fail together.
//
//   Communicator ranks;
//   return ranks.on_first([&] { return simulate(deck); });
//
// Works under mpirun and as a single process alike. The engine knows nothing of it.

#include <mpi.h>

#include <functional>
#include <string>

namespace carom {

class Communicator {
 public:
  /// Starts MPI (MPI_THREAD_FUNNELED) and duplicates the world communicator. One object a process, once.
  Communicator();
  ~Communicator();
  Communicator(const Communicator&) = delete;
  Communicator& operator=(const Communicator&) = delete;

  int rank() const { return rank_; }
  int size() const { return size_; }
  MPI_Comm handle() const { return world_; }

  /// Runs `work` on rank 0, while the others sleep. Returns its exit code on every rank. An Error that `work` throws is
  /// told on stderr and becomes its exit code; any other exception ends all ranks by abort() (or is thrown on, where
  /// there is one rank only).
  int on_first(const std::function<int()>& work) const;

  /// Ends all ranks at once with a message that names this one. For failures the other ranks cannot know of.
  [[noreturn]] void abort(int exit_code, const std::string& message) const;

 private:
  MPI_Comm world_ = MPI_COMM_NULL;
  int rank_ = 0;
  int size_ = 1;
};

}  // namespace carom
