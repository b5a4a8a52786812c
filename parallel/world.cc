#include "parallel/world.h"

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <new>

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

}  // namespace

World::World(double silence) {
  if (!launched()) return;
  int provided = 0;
  MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
  MPI_Comm_dup(MPI_COMM_WORLD, &world_);
  MPI_Comm_rank(world_, &rank_);
  MPI_Comm_size(world_, &size_);
  if (size_ > 1) watch_ = std::make_unique<Watch>(world_, silence);
}

World::~World() {
  if (world_ == MPI_COMM_NULL) return;
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
