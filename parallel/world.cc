// SPDX-License-Identifier: BSD-3-Clause
#include "parallel/world.h"

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <mutex>
#include <new>
#include <stop_token>
#include <thread>

#include "engine/base/error.h"

namespace carom {

namespace {

Outcome outcome_of(const std::function<int()>& work) {
  try {
    return {work()};
  } catch (const RankFailure&) {
    return {.code = kFault, .left = true};
  } catch (const SilentRanks& e) {
    return {.code = kFault, .failure = e.what(), .left = true};
  } catch (const Error& e) {
    return {e.exit_code(), e.what()};
  } catch (const std::bad_alloc&) {
    return {kFault, "out of memory"};
  } catch (const std::exception& e) {
    return {kFault, std::string("internal error: ") + e.what()};
  }
}

/// Whether a launcher has started this process, perhaps with others.
bool launched() { return std::getenv("PMIX_RANK") != nullptr || std::getenv("PMI_RANK") != nullptr; }

/// Ends the process where MPI takes longer than the silence allowed. MPI starts and ends in calls that wait for all
/// ranks: nothing else can leave them when one is stopped.
class Guard {
 public:
  /// `silence`: seconds; 0: never. `what`: does not begin or end.
  Guard(double silence, const char* what) {
    if (silence > 0) thread_ = std::jthread([=](const std::stop_token& over) { watch(over, silence, what); });
  }

 private:
  static void watch(const std::stop_token& over, double silence, const char* what) {
    constexpr auto kTimeBetweenWaits = std::chrono::milliseconds(100);
    std::mutex mutex;
    std::unique_lock lock(mutex);
    for (Patience patience; patience.waited() <= silence;)
      if (std::condition_variable_any().wait_for(lock, over, kTimeBetweenWaits, [] { return false; });
          over.stop_requested())
        return;
    const char* rank = std::getenv("OMPI_COMM_WORLD_RANK");
    std::fprintf(stderr,
                 "carom: rank %s: MPI does not %s within %g s: another rank is stopped or cut off, or slow; --silence "
                 "allows longer waits\n",
                 rank != nullptr ? rank : "unknown", what, silence);
    std::fflush(stderr);
    std::_Exit(kFault);  // the launcher ends the others
  }

  std::jthread thread_;  // ends with the object
};

}  // namespace

World::World(double silence) : silence_(silence) {
  if (!launched()) return;
  const Guard guard(silence, "start");
  int provided = 0;
  MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
  MPI_Comm_dup(MPI_COMM_WORLD, &world_);
  MPI_Comm_rank(world_, &rank_);
  MPI_Comm_size(world_, &size_);
  if (size_ > 1) watch_ = std::make_unique<Watch>(world_, silence);
}

World::~World() {
  if (world_ == MPI_COMM_NULL) return;
  const Guard guard(silence_, "end");
  watch_.reset();
  MPI_Comm_free(&world_);
  MPI_Finalize();
}

int World::on_all(const std::function<int()>& work) const {
  const Outcome outcome = outcome_of(work);
  if (watch_) return watch_->settle(outcome, false);
  if (!outcome.failure.empty()) std::fprintf(stderr, "%s\n", outcome.failure.c_str());
  return outcome.code;
}

int World::on_first(const std::function<int()>& work) const {
  if (!watch_) return on_all(work);
  return watch_->settle(rank_ == 0 ? outcome_of(work) : Outcome{}, true);
}

}  // namespace carom
