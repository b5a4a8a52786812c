// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A table by slot, for the few spheres of a core that have entries.

#include <deque>
#include <limits>
#include <span>
#include <vector>

#include "engine/base/record.h"

namespace carom {

template <class T>
class BySlot {
 public:
  explicit BySlot(std::size_t slots) : index_(slots, kAbsent) {}
  bool has(Slot i) const { return index_[i] != kAbsent; }
  /// The entry of a sphere; it must have one.
  T& at(Slot i) { return items_[index_[i]]; }
  const T& at(Slot i) const { return items_[index_[i]]; }
  /// Adds an entry for a sphere that has none; it may contain the values of an earlier entry.
  T& add(Slot i) {
    index_[i] = static_cast<std::uint32_t>(slots_.size());
    slots_.push_back(i);
    if (items_.size() < slots_.size()) items_.emplace_back();
    return items_[index_[i]];
  }
  /// The spheres with entries, in the order in which they were added.
  std::span<const Slot> slots() const { return slots_; }
  void clear() {
    for (const Slot i : slots_) index_[i] = kAbsent;
    slots_.clear();
  }

 private:
  static constexpr std::uint32_t kAbsent = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> index_;  // by slot
  std::vector<Slot> slots_;
  std::deque<T> items_;  // never shrinks, to reuse its memory; entries do not move
};

}  // namespace carom
