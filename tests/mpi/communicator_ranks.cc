// Ranks that fail, for tests/mpi/CMakeLists.txt: `communicator_ranks WHAT`.
//   ok      rank 0 returns 7: so do all
//   error   rank 0 throws an Error of exit code 4: all end with it
//   bug     rank 0 throws something else: all are ended, with a message that names the rank
//   abort   rank 1 gives up while the others wait for ever

#include <chrono>
#include <iostream>
#include <string>
#include <thread>

#include "engine/error.h"
#include "parallel/communicator.h"

namespace {

int work(const std::string& what) {
  if (what == "error") throw carom::Error(carom::Failure::numerical, "a numerical failure");
  if (what == "bug") throw std::logic_error("a bug");
  return 7;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "ok";
  const carom::Communicator ranks;
  if (what == "abort") {
    if (ranks.rank() == 1) ranks.abort(5, "a full disk");
    for (;;) std::this_thread::sleep_for(std::chrono::seconds(1));
  }
  const int code = ranks.on_first([&] { return work(what); });
  std::cout << "rank of " + std::to_string(ranks.size()) + " ends with " + std::to_string(code) + "\n" << std::flush;
  return code;
}
