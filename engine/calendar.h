#pragma once
// The event queue: a calendar of time bins with a small heap for the present.
//
// Entries of later bins are only appended; a bin is sorted once, when its time has come, and then served in order
// beside a heap that holds what is scheduled into the present. Nothing is ever removed: an entry whose particle has
// been scheduled anew since is recognised by its stamp and dropped by the caller when it is met. (Brown, Commun. ACM 31
// (1988) 1220; Paul, J. Comput. Phys. 221 (2007) 615.)

#include <algorithm>
#include <boost/heap/d_ary_heap.hpp>
#include <cmath>
#include <cstdint>
#include <vector>

namespace carom {

struct CalendarEntry {
  double time;
  std::uint32_t slot;   ///< whose event it is
  std::uint32_t stamp;  ///< valid while it is the slot's newest
};

/// Serves entries by time; the order of equal times is the caller's business.
class Calendar {
 public:
  /// Empties the calendar and sets it up for times in [0, horizon), of which about `expected` will be scheduled.
  void reset(double horizon, std::size_t expected) {
    horizon_ = horizon;
    bins_.resize(std::clamp<std::size_t>(expected / kEntriesPerBin, 1, kMostBins));
    for (auto& bin : bins_) bin.clear();
    per_time_ = static_cast<double>(bins_.size()) / horizon;
    sorted_.clear();
    present_.clear();
    current_ = 0;
    opened_ = false;
  }

  /// Schedules an entry; times at or beyond the horizon are not kept.
  void push(const CalendarEntry& entry) {
    if (!(entry.time < horizon_)) return;
    const std::size_t bin = bin_of(entry.time);
    if (bin < current_ || (bin == current_ && opened_))
      present_.push(entry);
    else
      bins_[bin].push_back(entry);
  }

  /// The earliest entry, or null when none is left. Stays valid until the next call.
  const CalendarEntry* top() {
    for (;;) {
      if (!opened_) open();
      if (sorted_.empty() && present_.empty()) {
        if (current_ + 1 >= bins_.size()) return nullptr;
        ++current_;
        opened_ = false;
        continue;
      }
      from_heap_ = !present_.empty() && (sorted_.empty() || present_.top().time < sorted_.back().time);
      return from_heap_ ? &present_.top() : &sorted_.back();
    }
  }

  /// Removes what top() returned.
  void pop() {
    if (from_heap_)
      present_.pop();
    else
      sorted_.pop_back();
  }

 private:
  struct Later {  // boost::heap keeps the largest on top
    bool operator()(const CalendarEntry& a, const CalendarEntry& b) const { return b.time < a.time; }
  };
  static constexpr std::size_t kEntriesPerBin = 8, kMostBins = std::size_t{1} << 20;

  std::size_t bin_of(double time) const {
    return std::min(bins_.size() - 1, static_cast<std::size_t>(std::max(0.0, time) * per_time_));
  }
  void open() {
    sorted_.swap(bins_[current_]);
    bins_[current_].clear();
    std::sort(sorted_.begin(), sorted_.end(), Later{});
    opened_ = true;
  }

  double horizon_ = 0, per_time_ = 0;
  std::vector<std::vector<CalendarEntry>> bins_;
  std::vector<CalendarEntry> sorted_;  // the current bin, latest first
  boost::heap::d_ary_heap<CalendarEntry, boost::heap::arity<4>, boost::heap::compare<Later>> present_;
  std::size_t current_ = 0;
  bool opened_ = false, from_heap_ = false;
};

}  // namespace carom
