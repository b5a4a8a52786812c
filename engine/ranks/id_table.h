// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Slots by id, for cores that have only part of all spheres: a hash table with open addressing.

#include <bit>
#include <limits>
#include <vector>

#include "engine/base/record.h"

namespace carom {

class IdTable {
 public:
  static constexpr Slot kNowhere = std::numeric_limits<Slot>::max();

  /// An empty table with room for `most` entries.
  explicit IdTable(std::size_t most) : entries_(std::bit_ceil(most + most / 2 + 2)), mask_(entries_.size() - 1) {}

  /// The slot of a sphere, or kNowhere.
  Slot find(Id id) const {
    for (std::size_t at = home(id);; at = (at + 1) & mask_)
      if (entries_[at].slot == kNowhere || entries_[at].id == id) return entries_[at].slot;
  }
  void add(Id id, Slot slot) {
    std::size_t at = home(id);
    while (entries_[at].slot != kNowhere && entries_[at].id != id) at = (at + 1) & mask_;
    entries_[at] = {id, slot};
  }
  /// Removes an existing entry; later entries move up to close the gap.
  void remove(Id id) {
    std::size_t gap = home(id);
    while (entries_[gap].id != id || entries_[gap].slot == kNowhere) gap = (gap + 1) & mask_;
    for (std::size_t at = (gap + 1) & mask_; entries_[at].slot != kNowhere; at = (at + 1) & mask_) {
      if (((at - home(entries_[at].id)) & mask_) < ((at - gap) & mask_)) continue;  // its home is after the gap
      entries_[gap] = entries_[at];
      gap = at;
    }
    entries_[gap] = {};
  }

 private:
  struct Entry {
    Id id = 0;
    Slot slot = kNowhere;
  };
  std::size_t home(Id id) const { return (id * 0x9E3779B97F4A7C15ull >> 32) & mask_; }

  std::vector<Entry> entries_;
  std::size_t mask_;
};

}  // namespace carom
