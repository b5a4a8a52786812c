// SPDX-License-Identifier: BSD-3-Clause
// Ranks that work together and fail, for tests/mpi/CMakeLists.txt: `communicator_ranks WHAT [SILENCE]`.
//
// On rank 0 while the other ranks sleep:
//   ok        returns 7, and so do all ranks
//   error     throws an Error of exit code 4: all ranks end with it
//   bug       throws another exception: all ranks are ended
// On all ranks:
//   alike     all throw equal Errors, one after the other
//   one       rank 1 throws an exception, the other ranks wait for it in a call
//   memory    rank 1 has no memory left
//   first     rank 0 throws an Error, the other ranks wait
//   busy      rank 1 throws an Error, the other ranks compute without end
//   killed    rank 1 is killed
//   stopped   rank 1 is stopped
//   late      rank 1 computes longer than the silence and is treated as lost
//   suspended all are stopped for longer than the silence, and continue without an error
//   calls     the calls of the communicator give the expected results
//   latency   microseconds of the calls, beside MPI_Allreduce

#include <mpi.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <limits>
#include <new>
#include <string>
#include <thread>

#include "engine/base/error.h"
#include "parallel/world.h"

namespace {

using carom::Bytes;
using carom::Communicator;
using carom::Error;
using carom::Failure;

void sleep(double seconds) { std::this_thread::sleep_for(std::chrono::duration<double>(seconds)); }

int first(const std::string& what) {
  if (what == "error") throw Error(Failure::numerical, "a numerical failure");
  if (what == "bug") throw std::logic_error("a bug");
  return 7;
}

void require(bool holds, const char* what) {
  if (!holds) throw std::logic_error(std::string("wrong: ") + what);
}

Bytes filled(std::size_t size, int from, int to) {
  Bytes bytes(size);
  for (std::size_t k = 0; k < size; ++k)
    bytes[k] = static_cast<std::byte>(31 * from + 17 * to + static_cast<int>(k % 251));
  return bytes;
}

/// Checks all functions of a Communicator with messages of all sizes.
void check_calls(Communicator& ranks) {
  const int rank = ranks.rank(), size = ranks.size();
  for (const std::size_t length : {std::size_t{0}, std::size_t{1}, std::size_t{1000}, std::size_t{3000000}}) {
    // Rank a sends a message to b if a + b is not a multiple of 3.
    const auto sends = [](int a, int b) { return (a + b) % 3 != 0; };
    std::vector<Bytes> outgoing(static_cast<std::size_t>(size));
    for (int r = 0; r < size; ++r)
      if (sends(rank, r)) outgoing[static_cast<std::size_t>(r)] = filled(length + static_cast<std::size_t>(r), rank, r);
    const auto incoming = ranks.swap(std::move(outgoing));
    require(incoming.size() == static_cast<std::size_t>(size), "number of messages");
    for (int r = 0; r < size; ++r)
      require(incoming[static_cast<std::size_t>(r)] ==
                  (sends(r, rank) ? filled(length + static_cast<std::size_t>(rank), r, rank) : Bytes{}),
              "swap");
    // In a ring: with two ranks both neighbours are the same rank, with one rank there are none.
    std::vector<int> partners;
    for (const int r : {(rank + 1) % size, (rank + size - 1) % size})
      if (r != rank && std::find(partners.begin(), partners.end(), r) == partners.end()) partners.push_back(r);
    std::vector<Bytes> messages;
    for (const int r : partners) messages.push_back(filled(sends(rank, r) ? length : length / 7, rank, r));
    const auto received = ranks.swap(std::move(messages), partners);
    require(received.size() == partners.size(), "number of messages");
    for (std::size_t k = 0; k < partners.size(); ++k)
      require(received[k] == filled(sends(partners[k], rank) ? length : length / 7, partners[k], rank),
              "swap of neighbours");
    // Between start() and complete() other messages travel.
    std::vector<std::size_t> sizes;
    messages.clear();
    for (const int r : partners) {
      messages.push_back(filled(sends(rank, r) ? length : length / 7, rank, r));
      sizes.push_back(sends(r, rank) ? length : length / 7);
    }
    std::vector<double> most = {static_cast<double>(rank), -1.0 - rank};
    if (length == 1000) most.clear();
    ranks.start(messages, partners, sizes, most);
    require(ranks.gather(filled(3, rank, 0)).size() == static_cast<std::size_t>(size), "gather before complete");
    const auto arrived = ranks.complete();
    for (std::size_t k = 0; k < partners.size(); ++k)
      require(arrived[k] == filled(sizes[k], partners[k], rank), "start and complete");
    require(most.empty() || (most[0] == size - 1 && most[1] == -1), "maxima of start");
    // A rank may be ahead of its neighbours: messages that have not left stay what they were.
    for (int step = 0; step < 6; ++step) {
      messages.clear();
      for (std::size_t k = 0; k < partners.size(); ++k) messages.push_back(filled(length, rank, step));
      ranks.start(messages, partners, std::vector<std::size_t>(partners.size(), length), {});
      if (length > 1000 && step % size == rank) sleep(0.1);
      const auto next = ranks.complete();
      for (std::size_t k = 0; k < partners.size(); ++k)
        require(next[k] == filled(length, partners[k], step), "the messages of a step");
    }
    const auto all = ranks.gather(filled(length * static_cast<std::size_t>(rank), rank, 0));
    for (int r = 0; r < size; ++r)
      require(all[static_cast<std::size_t>(r)] == filled(length * static_cast<std::size_t>(r), r, 0), "gather");
  }
  std::vector<double> values = {static_cast<double>(rank), -static_cast<double>(rank), rank == 1 ? 0.0 : -0.0,
                                rank == 1 ? std::numeric_limits<double>::infinity() : 5.0};
  ranks.largest(values);
  require(values[0] == size - 1 && values[1] == 0 && std::isinf(values[3]), "largest");
  Bytes bits(sizeof values[2]);
  std::memcpy(bits.data(), &values[2], bits.size());
  for (const Bytes& theirs : ranks.gather(bits)) require(theirs == bits, "the same bits everywhere");
  std::vector<std::uint64_t> counts = {1, static_cast<std::uint64_t>(rank) << 60};
  ranks.sum(counts);
  std::uint64_t high = 0;
  for (int r = 0; r < size; ++r) high += static_cast<std::uint64_t>(r) << 60;
  require(counts[0] == static_cast<std::uint64_t>(size) && counts[1] == high, "sum");
}

void measure(Communicator& ranks) {
  const auto show = [&](const char* name, const auto& call) {
    std::vector<double> times;
    for (int k = 0; k < 101; ++k) {
      MPI_Barrier(MPI_COMM_WORLD);
      const double start = MPI_Wtime();
      for (int i = 0; i < 1000; ++i) call();
      times.push_back(1e3 * (MPI_Wtime() - start));
    }
    std::sort(times.begin(), times.end());
    if (ranks.rank() == 0) std::printf("%-28s %8.2f µs, at best %.2f\n", name, times[50], times[0]);
  };
  double value = 1, most = 0;
  show("MPI_Allreduce, 1 double", [&] { MPI_Allreduce(&value, &most, 1, MPI_DOUBLE, MPI_MAX, MPI_COMM_WORLD); });
  show("largest, 1 double", [&] { ranks.largest({&value, 1}); });
  const std::vector<Bytes> nothing(static_cast<std::size_t>(ranks.size()));
  show("swap, nothing", [&] { ranks.swap(nothing); });
  const std::vector<Bytes> some(static_cast<std::size_t>(ranks.size()), Bytes(1000));
  show("swap, 1000 bytes each", [&] { ranks.swap(some); });
  const int other = ranks.rank() ^ 1;  // the last of an odd number has no partner
  const std::vector<int> partners(other < ranks.size() ? 1 : 0, other);
  const std::vector<Bytes> messages(partners.size(), Bytes(1000));
  show("swap in pairs, 1000 bytes", [&] { ranks.swap(messages, partners); });
}

int all(const std::string& what, Communicator& ranks) {
  const auto meet = [&] {
    double value = 0;
    ranks.largest({&value, 1});
  };
  for (int k = 0; k < 3; ++k) meet();
  const bool is_one = ranks.rank() == 1;
  if (what == "calls") check_calls(ranks);
  if (what == "latency") measure(ranks);
  if (what == "alike") {
    sleep(0.3 * ranks.rank());
    throw Error(Failure::numerical, "no rank can do this");
  }
  if (what == "one" && is_one) throw std::logic_error("a bug");
  if (what == "memory" && is_one) throw std::bad_alloc();
  if (what == "first" && ranks.rank() == 0) throw Error(Failure::file, "a full disk");
  if (what == "busy") {
    if (is_one) throw Error(Failure::numerical, "it alone cannot do this");
    for (;;) sleep(1);
  }
  if (what == "killed" && is_one) std::raise(SIGKILL);
  if (what == "stopped" && is_one) std::raise(SIGSTOP);
  if (what == "late" && is_one) sleep(60);
  if (what == "suspended") {
    // Stops this process while it waits for rank 0, or stops rank 0 itself.
    const pid_t me = getpid();
    if (fork() == 0) {
      sleep(0.3);
      kill(me, SIGSTOP);
      sleep(4);
      kill(me, SIGCONT);
      _exit(0);
    }
    for (int k = 0; k < 10 && ranks.rank() == 0; ++k) sleep(0.1);
  }
  meet();
  return 7;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "ok";
  const carom::World ranks(argc > 2 ? std::stod(argv[2]) : 0);
  const bool alone = what == "ok" || what == "error" || what == "bug";
  const auto together = [&] {
    try {
      return all(what, ranks.communicator());
    } catch (const carom::RankFailure& e) {
      std::cout << "received: " << e.what() << std::endl;
      throw;
    }
  };
  const int code = alone ? ranks.on_first([&] { return first(what); }) : ranks.on_all(together);
  std::cout << "rank of " + std::to_string(ranks.size()) + " ends with " + std::to_string(code) + "\n" << std::flush;
  return code;
}
