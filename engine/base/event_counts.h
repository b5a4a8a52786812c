// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// What an event core has done, counted: the same numbers on every machine, unlike times.

#include <cstdint>

namespace carom {

struct EventCounts {
  std::uint64_t predictions = 0;  ///< scans of a particle's surroundings for its next contact
  std::uint64_t candidates = 0;   ///< pairs evaluated in them
  std::uint64_t stale = 0;  ///< contacts that came up after their partner had collided: the particle is scanned again
  std::uint64_t crossings = 0;  ///< particles that moved into another cell
  std::uint64_t rebuilds = 0;   ///< neighbour lists made anew (0 where the core works on cells alone)
  std::uint64_t scheduled = 0;  ///< entries put into the calendar
  std::uint64_t dropped = 0;    ///< of these, met when they no longer held

  EventCounts& operator+=(const EventCounts& other) {
    predictions += other.predictions;
    candidates += other.candidates;
    stale += other.stale;
    crossings += other.crossings;
    rebuilds += other.rebuilds;
    scheduled += other.scheduled;
    dropped += other.dropped;
    return *this;
  }
};

/// What agreement between subdomains took on one rank (engine/ranks/windowed_flight.h).
struct WindowCounts {
  std::uint64_t subdomains = 0;  ///< of all ranks; fewer than requested where the box has no room for more
  std::uint64_t windows = 0;
  std::uint64_t rounds = 0;         ///< of exchange and repair
  std::uint64_t cut = 0;            ///< windows that were cut because a sphere was too fast
  std::uint64_t events = 0;         ///< of own spheres, as they are in the end
  std::uint64_t run_events = 0;     ///< in first runs, those of ghosts among them
  std::uint64_t redone_events = 0;  ///< in repairs
};

}  // namespace carom
