#include "parallel/communicator.h"

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <thread>

#include "engine/error.h"

namespace carom {

namespace {

// A collective call spins while it waits; a rank with nothing to do for hours should sleep instead.
void wait_asleep(MPI_Request& request) {
  auto nap = std::chrono::milliseconds(1);
  for (int done = 0; MPI_Test(&request, &done, MPI_STATUS_IGNORE), done == 0;) {
    std::this_thread::sleep_for(nap);
    if (nap < std::chrono::milliseconds(50)) nap *= 2;
  }
}

}  // namespace

Communicator::Communicator() {
  // A process started without a launcher needs neither a daemon of Open MPI's beside it nor its directory in /tmp,
  // which may be full, and which other jobs of the same user take away when they end. Only defaults: the user's word
  // counts.
  if (std::getenv("PMIX_RANK") == nullptr && std::getenv("PMI_RANK") == nullptr) {
    setenv("OMPI_MCA_ess_singleton_isolated", "1", 0);
    setenv("OMPI_MCA_orte_create_session_dirs", "0", 0);
  }
  int provided = 0;
  MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
  MPI_Comm_dup(MPI_COMM_WORLD, &world_);
  MPI_Comm_rank(world_, &rank_);
  MPI_Comm_size(world_, &size_);
}

Communicator::~Communicator() {
  MPI_Comm_free(&world_);
  MPI_Finalize();
}

int Communicator::on_first(const std::function<int()>& work) const {
  int code = 0;
  if (rank_ == 0) try {
      code = work();
    } catch (const Error& e) {
      code = e.exit_code();
      std::fprintf(stderr, "%s\n", e.what());
    } catch (const std::exception& e) {
      if (size_ == 1) throw;
      abort(EXIT_FAILURE, e.what());
    }
  // Everything must be said before the others know: the first of them to end with an error makes mpirun end the rest.
  std::cout.flush();
  std::fflush(nullptr);
  if (size_ > 1) {
    MPI_Request request = MPI_REQUEST_NULL;
    MPI_Ibcast(&code, 1, MPI_INT, 0, world_, &request);
    wait_asleep(request);
  }
  return code;
}

void Communicator::abort(int exit_code, const std::string& message) const {
  std::fprintf(stderr, "carom: rank %d of %d: %s\n", rank_, size_, message.c_str());
  std::fflush(nullptr);
  MPI_Abort(world_, exit_code);
  std::abort();  // MPI_Abort does not return; the compiler cannot know
}

}  // namespace carom
