// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The event queue: a ring of time bins, with a small heap for the bin that is open.
//
// Entries for later bins are only appended, to a few cache lines in use; entries beyond the ring wait in a separate
// list. A bin is sorted once when it opens, then served in order, merged with a heap of entries scheduled into the open
// bin. Entries are never removed: the caller decides which are still valid when a bin opens and again when an entry is
// served. Bin widths adapt to the rate of events. (Brown, Commun. ACM 31 (1988) 1220; Paul, J. Comput. Phys. 221 (2007)
// 615.)

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
  std::uint32_t slot;  ///< slot of the sphere with this event
};
#pragma pack(pop)
static_assert(sizeof(CalendarEntry) == 12);  // several entries exist for every particle

/// Serves entries by time; the caller orders entries with equal times.
class Calendar {
 public:
  /// Empties the calendar and sets it up for times in [now, horizon) and about `entries` entries at once, distributed
  /// like `sample`. `entries_per_bin` sets the bin size (0: automatic).
  void reset(double horizon, std::size_t entries, double entries_per_bin = 0, std::vector<double> sample = {},
             double now = 0) {
    horizon_ = horizon;
    forced_ = entries_per_bin > 0;
    wanted_ = forced_ ? entries_per_bin : std::clamp(static_cast<double>(entries) / 256, 8.0, 2048.0);
    ring_.assign(kBins, Bin{});
    chunks_.clear();
    chunks_.reserve(2 * entries / kChunk + kBins);  // growing would copy; unused memory is never touched
    next_.clear();
    free_ = kNoChunk;
    later_ = Bin{};
    present_.clear();
    sorted_.clear();
    due_ = due_end_ = nullptr;
    // The bin width follows from the density of the earliest entries.
    const double each = static_cast<double>(entries) / static_cast<double>(std::max<std::size_t>(sample.size(), 1));
    const auto few = std::min(sample.size(), static_cast<std::size_t>(16 * wanted_ / each) + 16);
    double end = horizon;
    if (few > 0) {
      std::nth_element(sample.begin(), sample.begin() + static_cast<std::ptrdiff_t>(few - 1), sample.end());
      end = std::min(end, sample[few - 1]);
    }
    lay_out(now, (end - now) * wanted_ / (each * static_cast<double>(std::max<std::size_t>(few, 1))));
  }

  /// Schedules an entry; entries at or beyond the horizon are discarded.
  void push(double time, std::uint32_t slot) {
    if (!(time < horizon_)) return;
    const double bin = (time - start_) * per_width_;
    if (!(bin < kBins))
      append(later_, {time, slot});
    else if (const int number = static_cast<int>(bin); number > current_)
      append(ring_[static_cast<std::size_t>(number)], {time, slot});
    else
      push_present({time, slot});
  }

  /// The earliest entry, or null if none is left before the horizon; valid until the next call. Entries with
  /// holds(entry) false may be skipped.
  template <class Holds>
  const CalendarEntry* top(Holds&& holds) {
    do {
      const bool heap = !present_.empty();
      from_heap_ = heap && (due_ == due_end_ || present_.top().time < due_->time);
      if (from_heap_) return &present_.top();
      if (due_ != due_end_) return due_;
    } while (open_next(holds));
    return nullptr;
  }

  void pop() {
    if (from_heap_)
      present_.pop();
    else
      ++due_;
  }

  /// Whether another entry has this time, which must be that of the entry served last.
  bool more_at(double time) const {
    return (due_ != due_end_ && due_->time == time) || (!present_.empty() && present_.top().time == time);
  }

  /// The entry due `ahead` places later, or null if it is not yet sorted.
  const CalendarEntry* upcoming(std::size_t ahead) const {
    return static_cast<std::ptrdiff_t>(ahead) < due_end_ - due_ ? due_ + ahead : nullptr;
  }

 private:
  struct Earlier {
    bool operator()(const CalendarEntry& a, const CalendarEntry& b) const { return a.time < b.time; }
  };
  struct Later {  // boost::heap keeps the largest on top
    bool operator()(const CalendarEntry& a, const CalendarEntry& b) const { return b.time < a.time; }
  };
  static constexpr std::uint32_t kNoChunk = 0xffffffff;
  static constexpr std::uint32_t kChunk = 16;  // entries of a chunk: three cache lines
  static constexpr int kBins = 2048;
  struct Chunk {
    CalendarEntry entry[kChunk];
  };
  struct Bin {
    /// The chunk that was added last. It may be full, and then append() adds another one.
    std::uint32_t chunk = kNoChunk;
    std::uint32_t count = 0;
  };

  [[gnu::always_inline]] void append(Bin& bin, const CalendarEntry& entry) {
    const std::uint32_t at = bin.count % kChunk;
    if (at == 0) add_chunk(bin);
    chunks_[bin.chunk].entry[at] = entry;
    ++bin.count;
  }
  // Seldom needed, and large:
  [[gnu::noinline]] void add_chunk(Bin& bin) {
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
  [[gnu::noinline]] void push_present(const CalendarEntry& entry) { present_.push(entry); }

  /// Calls visit(entry) for the entries of a bin and frees its chunks.
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

  /// Opens the next nonempty bin; false if there is none. Requires sorted_ and present_ to be empty.
  template <class Holds>
  [[gnu::noinline]] bool open_next(Holds&& holds) {
    for (;;) {
      while (++current_ < kBins) {
        Bin& bin = ring_[static_cast<std::size_t>(current_)];
        if (bin.count == 0) continue;
        sorted_.resize(bin.count);
        count_ += bin.count;
        CalendarEntry* end = sorted_.data();
        empty(bin, [&](const CalendarEntry& entry) {
          *end = entry;
          end += holds(entry) ? 1 : 0;
        });
        sorted_.resize(static_cast<std::size_t>(end - sorted_.data()));
        sort();
        due_ = sorted_.data();
        due_end_ = due_ + sorted_.size();
        if (due_ != due_end_) return true;
      }
      if (!turn(holds)) return false;
    }
  }

  /// Lays out the ring again from the earliest entry beyond it; false if there is none.
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

  /// Lays out the bins, each of this width, from `start`.
  void lay_out(double start, double width) {
    start_ = start;
    width_ = std::max(width, std::max(horizon_ * 1e-9, start_ * 1e-12));
    per_width_ = 1 / width_;
    count_ = 0;
    current_ = -1;
  }

  /// Sorts the opened bin: distributes it over buckets, then sorts by insertion.
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
      if (moves > 16 * n) {  // most entries are in one bucket
        std::sort(sorted_.begin(), sorted_.end(), Earlier{});
        return;
      }
    }
  }

  double horizon_ = 0, wanted_ = 8;
  bool forced_ = false;
  double start_ = 0, width_ = 0, per_width_ = 0;  // ring: start, width of a bin and its inverse
  int current_ = -1;                              // the open bin, or the last one opened
  std::vector<Bin> ring_;
  PageVector<Chunk> chunks_;
  std::vector<std::uint32_t> next_;  // by chunk: the previous chunk of its bin, or the next free chunk
  std::uint32_t free_ = kNoChunk;
  Bin later_;  // entries beyond the ring

  std::vector<CalendarEntry> sorted_, scratch_;  // the open bin
  std::vector<std::uint32_t> bucket_, which_;
  const CalendarEntry *due_ = nullptr, *due_end_ = nullptr;  // the rest of sorted_
  boost::heap::d_ary_heap<CalendarEntry, boost::heap::arity<4>, boost::heap::compare<Later>> present_;
  bool from_heap_ = false;

  std::size_t count_ = 0;  // entries opened since the ring was laid out
};

}  // namespace carom
