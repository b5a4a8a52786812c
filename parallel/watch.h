// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Waits between ranks, and the common end of all ranks when one of them fails.
//
// A waiting rank polls for notices from other ranks. A rank that fails sends a notice to rank 0, which queries the
// others. If one of them waits in a call that the failed rank will never make, the failure is not common to all: rank 0
// leaves its work (RankFailure), closes its files, names the failed rank and ends all ranks. If all ranks failed in the
// same way (a bad deck, an impossible step), the error is reported once and all return its exit code. Rank 0 waits at
// most kGrace for ranks that do not answer because they compute or are stopped.
//
// If a wait lasts longer than the allowed silence, the waiting rank queries the others and names the ranks that do not
// answer. Time in which the process does not run is not counted: a whole job may be suspended.

#include <mpi.h>

#include <array>
#include <cstdint>
#include <functional>
#include <list>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "parallel/world.h"

namespace carom {

/// The length of a wait [seconds], without time in which this process did not run.
class WaitTimer {
 public:
  /// The length so far; must be called regularly.
  double waited();
  /// Leaves the processor to others for a hundredth of the wait so far, at most `longest`.
  void pause(double longest) const;

 private:
  double last_ = -1, waited_ = 0;
};

class Watch {
 public:
  static constexpr double kGrace = 5;  ///< seconds

  /// Collective. `silence`: seconds after which ranks that do not answer count as lost; 0: never.
  Watch(MPI_Comm world, double silence);
  ~Watch();
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

  /// Call at the beginning of each collective call, so that ranks can compare their progress.
  void begin_call() { ++calls_; }

  /// Waits until all requests are complete. Throws RankFailure if they depend on a failed rank, or SilentRanks.
  void wait(std::span<MPI_Request> requests);
  double seconds_waited() const { return seconds_waited_; }  ///< in wait()

  /// Ends the work of all ranks together; collective. Returns the exit code of the first rank that failed, or of rank
  /// 0. If some ranks cannot be reached, it calls MPI_Abort and does not return. `alone`: only rank 0 works, for any
  /// length of time.
  int finish(const Outcome& mine, bool alone);

 private:
  enum class Kind : int { question, answer, ended, verdict };
  struct Notice {
    Kind kind;
    int code;
    std::uint64_t calls;               ///< collective calls begun by the sender
    std::array<char, 2000> failure{};  ///< the beginning of the message
  };
  struct Sent {
    Notice notice;
    MPI_Request request = MPI_REQUEST_NULL;
  };
  /// The last known state of a rank.
  struct State {
    std::uint64_t calls = 0;
    bool answered = false;
    std::optional<Outcome> outcome{};
  };

  void receive_next();
  void receive_notices();
  void process(int from, const Notice& notice);
  void send(int to, Kind kind, const Outcome& outcome = {});
  void query_ranks();
  bool some_wait_never_ends() const;
  std::string silence_of(const std::function<bool()>& is_over);
  int finish_first(const Outcome& mine, bool alone);
  int finish_other(const Outcome& mine, bool alone);
  std::string account(bool alone) const;
  std::string names(std::span<const int> ranks) const;
  [[noreturn]] void abort(int code, const std::string& message) const;

  MPI_Comm side_ = MPI_COMM_NULL;
  int rank_ = 0, size_ = 1;
  double silence_;
  double seconds_waited_ = 0;
  std::uint64_t calls_ = 0;
  std::vector<State> states_;   ///< by rank; only rank 0 receives outcomes
  std::optional<int> failed_;   ///< rank with the first notice of a failure
  std::optional<int> verdict_;  ///< exit code sent by rank 0
  Notice incoming_{};
  MPI_Request receive_ = MPI_REQUEST_NULL;
  std::list<Sent> sent_;
};

}  // namespace carom
