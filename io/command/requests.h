// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Requests to a running simulation from outside: signals and the wall clock.
//
//   TERM, INT, HUP   write a checkpoint and stop; a second INT ends the process at once
//   USR1             write a checkpoint and continue
//   USR2             write a checkpoint and stop (mpirun forwards USR1 and USR2 to its ranks)
//
// Handlers only set a flag. All ranks check it together: a signal to any rank applies to all.

#include <chrono>
#include <cstdint>
#include <limits>
#include <optional>

#include "engine/ranks/communicator.h"

namespace carom {

class Requests {
 public:
  /// Installs the signal handlers. `most`: wall time after which the run is to stop [s].
  explicit Requests(std::optional<double> most);

  /// Wall time between checkpoints [s]; nullopt: only when the run ends or is stopped.
  void set_interval(std::optional<double> seconds) { interval_ = seconds; }

  struct Asked {
    bool checkpoint = false, stop = false;
  };
  /// The requests so far, on any rank, by the clock of rank 0. Collective.
  Asked now(Communicator& ranks);
  /// Like now(), but checks less often if calls are frequent; at least at every `most`-th call. Collective.
  Asked now_and_then(Communicator& ranks, std::uint64_t most = std::numeric_limits<std::uint64_t>::max());
  /// Whether this rank has received a request to stop.
  bool stop_here(const Communicator& ranks) const;
  /// Whether this rank has received a signal to stop, or its own clock has reached the wall time.
  bool stops_this_rank() const;
  /// A checkpoint has been written.
  void checkpoint_is_written();
  /// Why the run was stopped, in words: the signal's name, or --max-wall.
  std::string reason() const;

 private:
  using Clock = std::chrono::steady_clock;
  static double seconds_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
  }
  std::optional<double> most_, interval_;
  Clock::time_point start_ = Clock::now(), last_checkpoint_ = start_, last_look_ = start_;
  std::uint64_t calls_ = 0, between_ = 1;  // calls of now_and_then(): since the last check; between two checks
};

}  // namespace carom
