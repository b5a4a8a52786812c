#pragma once
// Something that only a few spheres of a core have, by slot.

#include <deque>
#include <limits>
#include <span>
#include <vector>

#include "engine/record.h"

namespace carom {

template <class T>
class BySlot {
 public:
  void resize(std::size_t slots) { index_.resize(slots, kNone); }
  bool has(Slot i) const { return index_[i] != kNone; }
  /// Of a sphere that has it.
  T& at(Slot i) { return items_[index_[i]]; }
  const T& at(Slot i) const { return items_[index_[i]]; }
  /// Gives it to a sphere that has it not, as it was left by somebody before.
  T& add(Slot i) {
    index_[i] = static_cast<std::uint32_t>(who_.size());
    who_.push_back(i);
    if (items_.size() < who_.size()) items_.emplace_back();
    return items_[index_[i]];
  }
  /// Everybody who has it, in the order in which they got it.
  std::span<const Slot> who() const { return who_; }
  void clear() {
    for (const Slot i : who_) index_[i] = kNone;
    who_.clear();
  }

 private:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> index_;  // by slot
  std::vector<Slot> who_;
  std::deque<T> items_;  // kept for their memory; they stay where they are
};

}  // namespace carom
