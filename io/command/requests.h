// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// What is asked of a run from outside while it goes on: signals and the wall clock.
//
//   TERM, INT, HUP   write a checkpoint and stop; a second INT ends the process at once
//   USR1             write a checkpoint and go on
//   USR2             write a checkpoint and stop (mpirun passes USR1 and USR2 on to its ranks)
//
// Handlers only set a flag. All ranks look at it together: a signal to any of them counts for all.

#include <chrono>
#include <cstdint>
#include <limits>
#include <optional>

#include "engine/ranks/communicator.h"

namespace carom {

class Requests {
 public:
  /// Takes the signals over. `most`: wall time until the run is to stop; `between`: checkpoints [s].
  explicit Requests(std::optional<double> most);

  /// Wall time between checkpoints [s]; nothing: none but when the run ends or is stopped.
  void set_interval(std::optional<double> seconds) { interval_ = seconds; }

  struct Asked {
    bool checkpoint = false, stop = false;
  };
  /// What has been asked by now, on any rank; rank 0's clock counts. Collective.
  Asked now(Communicator& ranks);
  /// The same, looked at only now and then where calls come fast, but at every `most`-th call at least. Collective.
  Asked now_and_then(Communicator& ranks, std::uint64_t most = std::numeric_limits<std::uint64_t>::max());
  /// Whether this rank knows that the run is to stop.
  bool stop_here(const Communicator& ranks) const;
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
  std::uint64_t calls_ = 0, between_ = 1;  // of now_and_then(): since the last look; from look to look
};

}  // namespace carom
