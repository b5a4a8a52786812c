// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Counts of what an event core did. Unlike times, they are the same on every machine.

#include <cstdint>

namespace carom {

struct EventCounts {
  std::uint64_t predictions = 0;  ///< scans of a particle's surroundings for its next contact
  std::uint64_t candidates = 0;   ///< pairs evaluated in these scans
  std::uint64_t stale = 0;        ///< contacts due after the partner had collided: the particle is scanned again
  std::uint64_t crossings = 0;    ///< particles that moved into another cell
  std::uint64_t rebuilds = 0;     ///< rebuilds of neighbour lists (0 if the core uses cells alone)
  std::uint64_t scheduled = 0;    ///< entries put into the calendar
  std::uint64_t dropped = 0;      ///< scheduled entries that were invalid when they came up

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

/// The cost, on one rank, of making subdomains consistent (engine/ranks/windowed_flight.h).
struct WindowCounts {
  std::uint64_t subdomains = 0;  ///< on all ranks; fewer than requested if the box has no room for more
  std::uint64_t windows = 0;
  std::uint64_t rounds = 0;         ///< exchanges with neighbours, each followed by a repair
  std::uint64_t cut = 0;            ///< windows that were run again: too fast a sphere, no room for a ghost or event
  std::uint64_t events = 0;         ///< events of own spheres, in the final history
  std::uint64_t run_events = 0;     ///< events in first runs, including events of ghosts
  std::uint64_t redone_events = 0;  ///< events in repairs
};

}  // namespace carom
