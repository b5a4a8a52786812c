// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// events.h5: every collision of a run, exactly as it was executed, in the order of the event keys.
//
// The group /events has data sets with one row per collision:
//   time          simulated time (slab start + time_in_slab, rounded)
//   slab          number of the slab or epoch, from 0
//   time_in_slab  the exact time, since the start of the slab
//   generation    order within one instant
//   kind          0 pair, 1 wall, 2 kick; a pair at a step: 3 enters, 4 leaves, 5 bounces
//   lo, hi        lower and higher id; at a wall: the particle, and the number of the wall (2·axis + (0 lower, 1 upper)
//                 for faces of the box)
//   image         [D] how many box edges `hi` is shifted by
//   x_lo, x_hi    [D] centres at contact, x_hi shifted to that image; at a wall: the point of contact
//   impulse       [D] given to lo, taken from hi
// /parameters holds the resolved deck. Rows are buffered and written in batches, at the latest with the next frame or
// thermo row.

#include <filesystem>
#include <memory>
#include <optional>

#include "engine/run/simulation.h"
#include "io/deck/deck.h"
#include "io/files/file_mark.h"

namespace carom {

/// The position in events.h5.
struct EventMark {
  FileMark rows{};
  std::int64_t slabs = 0;  ///< done
};

/// The data sets that distinguish the rows of two runs.
inline constexpr const char* kEventRows[] = {"events/time", "events/lo", "events/hi", "events/x_lo"};

template <int D>
class EventWriter : public Observer<D> {
 public:
  /// Creates the file, or opens it again and continues from the mark. Throws Error(Failure::file).
  EventWriter(const std::filesystem::path& path, const Deck& deck, const std::optional<EventMark>& mark = {});
  ~EventWriter() override;

  void contacts(double slab_start, std::span<const Contact<D>> contacts) override;
  void frame(const Snapshot<D>&) override;
  void thermo(const Snapshot<D>&) override;
  void progress(const Statistics& statistics) override;

  /// Writes the buffered rows and returns the position in the file. Throws Error(Failure::file).
  EventMark mark();
  /// Writes the buffered rows and closes. Throws Error(Failure::file).
  void close();

 private:
  struct Contents;
  std::unique_ptr<Contents> contents_;
};

}  // namespace carom
