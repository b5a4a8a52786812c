// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The event queue: a ring of time bins with a small heap for the present.
//
// Entries of later bins are only appended, to a few lines that stay in the cache; what lies beyond the ring waits in a
// list of its own. When its time has come a bin is sorted once and then served in order, beside a heap that holds what
// is scheduled into the present. Nothing is ever removed: the caller decides which entries no longer hold, when a bin
// is opened and again when an entry is served. Bins adapt to the rate of events. (Brown, Commun. ACM 31 (1988) 1220;
// Paul, J. Comput. Phys. 221 (2007) 615.)

#include <algorithm>
#include <boost/heap/d_ary_heap.hpp>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "engine/base/pages.h"

namespace carom {

#pragma pack(push, 4)
struct CalendarEntry {
  double time;
  std::uint32_t slot;  ///< of the sphere that has the event
};
#pragma pack(pop)
static_assert(sizeof(CalendarEntry) == 12);  // there are some for every particle

/// Serves entries by time; the order of equal times is the caller's business.
class Calendar {
 public:
  /// Empties the calendar and sets it up for times in [now, horizon), for about `entries` entries at a time, which will
  /// be spread about like the `sample`. `entries_per_bin` forces the size of bins (0: about right).
  void reset(double horizon, std::size_t entries, double entries_per_bin = 0, std::vector<double> sample = {},
             double now = 0) {
    horizon_ = horizon;
    forced_ = entries_per_bin > 0;
    wanted_ = forced_ ? entries_per_bin : std::clamp(static_cast<double>(entries) / 256, 8.0, 2048.0);
    ring_.assign(kBins, Bin{});
    chunks_.clear();
    chunks_.reserve(2 * entries / kChunk + kBins);  // growing would copy; what is not used is not touched
    next_.clear();
    free_ = kNoChunk;
    later_ = Bin{};
    present_.clear();
    sorted_.clear();
    served_ = 0;
    // Bins for the density of the first entries there will be.
    const double each = static_cast<double>(entries) / static_cast<double>(std::max<std::size_t>(sample.size(), 1));
    const auto few = std::min(sample.size(), static_cast<std::size_t>(16 * wanted_ / each) + 16);
    double end = horizon;
    if (few > 0) {
      std::nth_element(sample.begin(), sample.begin() + static_cast<std::ptrdiff_t>(few - 1), sample.end());
      end = std::min(end, sample[few - 1]);
    }
    lay_out(now, (end - now) * wanted_ / (each * static_cast<double>(std::max<std::size_t>(few, 1))));
  }

  /// Schedules an entry; times at or beyond the horizon are not kept.
  void push(double time, std::uint32_t slot) {
    if (!(time < horizon_)) return;
    const double bin = (time - start_) * per_width_;
    if (!(bin < kBins))
      append(later_, {time, slot});
    else if (const int number = static_cast<int>(bin); number > current_)
      append(ring_[static_cast<std::size_t>(number)], {time, slot});
    else
      present_.push({time, slot});
  }

  /// The earliest entry, or null when none is left before the horizon. Stays valid until the next call. Entries for
  /// which holds(entry) is false may be left out.
  template <class Holds>
  const CalendarEntry* top(Holds&& holds) {
    for (;;) {
      const bool heap = !present_.empty();
      if (served_ < sorted_.size()) {
        from_heap_ = heap && present_.top().time < sorted_[served_].time;
        return from_heap_ ? &present_.top() : &sorted_[served_];
      }
      if (heap) {
        from_heap_ = true;
        return &present_.top();
      }
      if (!open_next(holds)) return nullptr;
    }
  }

  /// Removes what top() returned.
  void pop() {
    if (from_heap_)
      present_.pop();
    else
      ++served_;
  }

  /// Whether another entry of this time, that of the entry served last, is waiting.
  bool more_at(double time) const {
    return (served_ < sorted_.size() && sorted_[served_].time == time) ||
           (!present_.empty() && present_.top().time == time);
  }

  /// The entry that comes up `ahead` places later, as far as is known; null where it is not.
  const CalendarEntry* upcoming(std::size_t ahead) const {
    return served_ + ahead < sorted_.size() ? &sorted_[served_ + ahead] : nullptr;
  }

 private:
  struct Earlier {
    bool operator()(const CalendarEntry& a, const CalendarEntry& b) const { return a.time < b.time; }
  };
  struct Later {  // boost::heap keeps the largest on top
    bool operator()(const CalendarEntry& a, const CalendarEntry& b) const { return b.time < a.time; }
  };
  static constexpr std::uint32_t kNoChunk = 0xffffffff;
  static constexpr std::uint32_t kChunk = 16;  // entries: three cache lines
  static constexpr int kBins = 2048;
  struct Chunk {
    CalendarEntry entry[kChunk];
  };
  struct Bin {
    std::uint32_t chunk = kNoChunk;  // the last one, not full but for the moment
    std::uint32_t count = 0;
  };

  [[gnu::always_inline]] void append(Bin& bin, const CalendarEntry& entry) {
    const std::uint32_t at = bin.count % kChunk;
    if (at == 0) {
      std::uint32_t fresh = free_;
      if (fresh != kNoChunk) {
        free_ = next_[fresh];
      } else {
        fresh = static_cast<std::uint32_t>(chunks_.size());
        chunks_.emplace_back();
        next_.push_back(kNoChunk);
      }
      next_[fresh] = bin.chunk;
      bin.chunk = fresh;
    }
    chunks_[bin.chunk].entry[at] = entry;
    ++bin.count;
  }

  /// Calls visit(entry) for the entries of a bin and gives their memory back as it goes.
  template <class Visit>
  void empty(Bin& bin, Visit&& visit) {
    std::uint32_t n = in_last(bin);
    for (std::uint32_t chunk = bin.chunk; chunk != kNoChunk;) {
      for (std::uint32_t k = 0; k < n; ++k) visit(CalendarEntry(chunks_[chunk].entry[k]));
      const std::uint32_t next = next_[chunk];
      next_[chunk] = free_;
      free_ = chunk;
      chunk = next;
      n = kChunk;
    }
    bin = Bin{};
  }
  static std::uint32_t in_last(const Bin& bin) { return bin.count == 0 ? 0 : (bin.count - 1) % kChunk + 1; }

  /// Opens the next bin that has entries; false when there is none. sorted_ and present_ are empty.
  template <class Holds>
  bool open_next(Holds&& holds) {
    for (;;) {
      while (++current_ < kBins) {
        Bin& bin = ring_[static_cast<std::size_t>(current_)];
        if (bin.count == 0) continue;
        sorted_.resize(bin.count);
        served_ = 0;
        count_ += bin.count;
        CalendarEntry* end = sorted_.data();
        empty(bin, [&](const CalendarEntry& entry) {
          *end = entry;
          end += holds(entry) ? 1 : 0;
        });
        sorted_.resize(static_cast<std::size_t>(end - sorted_.data()));
        sort();
        if (!sorted_.empty()) return true;
      }
      if (!turn(holds)) return false;
    }
  }

  /// Lays out the ring anew from the first of the entries that wait; false where there are none.
  template <class Holds>
  bool turn(Holds&& holds) {
    current_ = kBins - 1;
    double start = std::numeric_limits<double>::infinity();
    std::uint32_t n = in_last(later_);
    for (std::uint32_t chunk = later_.chunk; chunk != kNoChunk; chunk = next_[chunk], n = kChunk)
      for (std::uint32_t k = 0; k < n; ++k)
        if (const CalendarEntry& entry = chunks_[chunk].entry[k]; entry.time < start && holds(entry))
          start = entry.time;
    Bin waiting = later_;
    later_ = Bin{};
    if (!(start < horizon_)) {
      empty(waiting, [](const CalendarEntry&) {});
      return false;
    }
    const double end = start_ + width_ * kBins;
    double width = width_;
    if (!forced_ && count_ > 0) {
      const double rate = static_cast<double>(count_) / (end - start_), factor = wanted_ / rate / width_;
      if (factor > 1.5 || factor < 0.67) width *= std::clamp(factor, 0.125, 8.0);
    }
    lay_out(start, width);
    empty(waiting, [&](const CalendarEntry& entry) {
      if (holds(entry)) push(entry.time, entry.slot);
    });
    return true;
  }

  /// Makes bins of a width from `start`.
  void lay_out(double start, double width) {
    start_ = start;
    width_ = std::max(width, std::max(horizon_ * 1e-9, start_ * 1e-12));
    per_width_ = 1 / width_;
    count_ = 0;
    current_ = -1;
  }

  /// Sorts the opened bin: into buckets first, then neighbours among themselves.
  void sort() {
    const std::size_t n = sorted_.size();
    if (n > 24) {
      const double start = start_ + current_ * width_, scale = per_width_ * static_cast<double>(n);
      bucket_.assign(n + 1, 0);
      which_.resize(n);
      for (std::size_t k = 0; k < n; ++k) {
        const double at = (sorted_[k].time - start) * scale;
        which_[k] = at <= 0 ? 0 : std::min(static_cast<std::uint32_t>(n - 1), static_cast<std::uint32_t>(at));
        ++bucket_[which_[k] + 1];
      }
      for (std::size_t b = 0; b < n; ++b) bucket_[b + 1] += bucket_[b];
      scratch_.resize(n);
      for (std::size_t k = 0; k < n; ++k) scratch_[bucket_[which_[k]]++] = sorted_[k];
      sorted_.swap(scratch_);
    }
    std::size_t moves = 0;
    for (std::size_t k = 1; k < n; ++k) {
      const CalendarEntry entry = sorted_[k];
      std::size_t to = k;
      for (; to > 0 && entry.time < sorted_[to - 1].time; --to) sorted_[to] = sorted_[to - 1];
      sorted_[to] = entry;
      moves += k - to;
      if (moves > 16 * n) {  // crowded into one bucket
        std::sort(sorted_.begin(), sorted_.end(), Earlier{});
        return;
      }
    }
  }

  double horizon_ = 0, wanted_ = 8;
  bool forced_ = false;
  double start_ = 0, width_ = 0, per_width_ = 0;  // of the ring
  int current_ = -1;                              // the bin that is open, or was last
  std::vector<Bin> ring_;
  PageVector<Chunk> chunks_;
  std::vector<std::uint32_t> next_;  // by chunk: the one filled before it, or the next free one
  std::uint32_t free_ = kNoChunk;
  Bin later_;  // beyond the ring

  std::vector<CalendarEntry> sorted_, scratch_;  // the open bin
  std::vector<std::uint32_t> bucket_, which_;
  std::size_t served_ = 0;
  boost::heap::d_ary_heap<CalendarEntry, boost::heap::arity<4>, boost::heap::compare<Later>> present_;
  bool from_heap_ = false;

  std::size_t count_ = 0;  // entries opened since the ring was laid out
};

}  // namespace carom
