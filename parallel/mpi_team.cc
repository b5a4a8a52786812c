// SPDX-License-Identifier: BSD-3-Clause
// The ranks that mpirun or srun has started.

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>

#include "parallel/mpi_communicator.h"

namespace carom {

namespace {

/// Whether a launcher started this process, perhaps with others.
bool launched() { return std::getenv("PMIX_RANK") != nullptr || std::getenv("PMI_RANK") != nullptr; }

/// Ends the process if starting or ending MPI takes longer than the allowed silence. These calls wait for all ranks and
/// cannot be left if one of them is stopped.
class Guard {
 public:
  /// `silence`: seconds; 0: never. `what`: "start" or "end", for the message.
  Guard(double silence, const char* what) {
    if (silence > 0) thread_ = std::jthread([=](const std::stop_token& over) { watch(over, silence, what); });
  }

 private:
  static void watch(const std::stop_token& over, double silence, const char* what) {
    constexpr auto kBetweenLooks = std::chrono::milliseconds(100);
    std::mutex mutex;
    std::unique_lock lock(mutex);
    for (WaitTimer timer; timer.waited() <= silence;)
      if (std::condition_variable_any().wait_for(lock, over, kBetweenLooks, [] { return false; });
          over.stop_requested())
        return;
    const char* rank = std::getenv("OMPI_COMM_WORLD_RANK");
    std::fprintf(stderr,
                 "carom: rank %s: MPI does not %s within %g s: another rank is stopped or cut off, or slow; --silence "
                 "allows longer waits\n",
                 rank != nullptr ? rank : "unknown", what, silence);
    std::fflush(stderr);
    std::_Exit(kFault);  // the launcher ends the other ranks
  }

  std::jthread thread_;  // ends with the object
};

class MpiTeam : public Team {
 public:
  /// Starts MPI (MPI_THREAD_FUNNELED) and duplicates the world communicator.
  explicit MpiTeam(double silence) : silence_(silence) {
    const Guard guard(silence, "start");
    int provided = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
    MPI_Comm_dup(MPI_COMM_WORLD, &world_);
    watch_.emplace(world_, silence);
    communicator_.emplace(world_, *watch_);
  }
  ~MpiTeam() override {
    const Guard guard(silence_, "end");
    watch_.reset();
    MPI_Comm_free(&world_);
    MPI_Finalize();
  }
  Communicator& communicator() override { return *communicator_; }
  int finish(const Outcome& mine, bool alone) override { return watch_->finish(mine, alone); }

 private:
  MPI_Comm world_ = MPI_COMM_NULL;
  double silence_;
  std::optional<Watch> watch_;
  std::optional<MpiCommunicator> communicator_;
};

}  // namespace

std::unique_ptr<Team> start_team(double silence) { return launched() ? std::make_unique<MpiTeam>(silence) : nullptr; }

std::string mpi_version() {
  char text[MPI_MAX_LIBRARY_VERSION_STRING];
  int length = 0;
  MPI_Get_library_version(text, &length);
  const std::string version(text, static_cast<std::size_t>(length));
  return version.substr(0, version.find(','));
}

}  // namespace carom
