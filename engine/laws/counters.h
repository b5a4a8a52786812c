// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Counts and times of an integrator. They do not affect the results.

#include <chrono>
#include <cstdint>
#include <utility>

#include "engine/base/event_counts.h"
#include "engine/laws/contact_tally.h"

namespace carom {

struct Counters : ContactTally {
  double force_passes = 0;   ///< pair evaluations of forces and Hessian products / interacting pairs
  std::uint64_t sweeps = 0;  ///< iterations of implicit solves
  std::uint64_t pieces = 0;  ///< edda: pieces in which steps were solved; more than the steps if any step was cut
  std::uint64_t slabs_halved = 0;
  std::uint64_t steps_rejected = 0;  ///< steps repeated because they were not accurate enough
  std::uint64_t fallbacks = 0;       ///< mcva: plain elastic impulses; edda: searches for the highest frequency
  std::uint64_t frozen = 0;          ///< edda: particles that kept the acceleration of an earlier sweep
  double folded = 0;                 ///< edda: Σ|r|, the energy errors folded into velocities [energy]
  std::uint64_t divisions = 0;       ///< times that particles were divided among ranks (methods with forces)
  std::uint64_t slabs_again = 0;     ///< slabs repeated with more ghosts or all particles
  std::uint64_t slabs_by_all = 0;    ///< slabs repeated with all particles
  EventCounts events;                ///< counts of the event core at the end of the last slab; 0 if the method has none
  WindowCounts windows;              ///< counts of this rank's subdomain; 0 if there is only one subdomain

  struct Seconds {
    double predict = 0, queue = 0, collide = 0, force = 0, sweep = 0, communicate = 0, output = 0;
  } seconds;

  void archive(Archive& archive) {
    ContactTally::archive(archive);
    archive(force_passes, sweeps, pieces, slabs_halved, steps_rejected, fallbacks, frozen, folded, divisions,
            slabs_again, slabs_by_all, events, windows, seconds);
  }
};

/// Adds its lifetime to a total, without the time that nested stopwatches measure.
class Stopwatch {
 public:
  explicit Stopwatch(double& total)
      : total_(total), outer_(std::exchange(running_, this)), start_(std::chrono::steady_clock::now()) {}
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;
  ~Stopwatch() {
    const double elapsed = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    total_ += elapsed - within_;
    if (outer_) outer_->within_ += elapsed;
    running_ = outer_;
  }

 private:
  inline static thread_local Stopwatch* running_ = nullptr;

  double& total_;
  double within_ = 0;  // measured by nested stopwatches
  Stopwatch* outer_;
  std::chrono::steady_clock::time_point start_;
};

}  // namespace carom
