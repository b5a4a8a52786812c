// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The log of a window that the event core writes: enough to revoke any event and to read the path of any sphere.
//
// The log is in the order of keys and costs 192 bytes an event. Paths are read from it only for the
// few spheres near the border of a subdomain (engine/ranks/window_paths.h).

#include <algorithm>
#include <limits>
#include <span>
#include <vector>

#include "engine/base/pages.h"
#include "engine/base/particles.h"
#include "engine/base/prefetch.h"
#include "engine/base/record.h"
#include "engine/laws/contact_log.h"

namespace carom {

/// An event of one sphere, and the sphere's record after it.
template <int D>
struct Node {
  Record<D> after;
  EventKey<D> key{};
  Internal<D> internal{};  ///< of the sphere after the event; zero if spheres have none; last, so that messages omit it

  /// The other sphere's id; kNoPartner in a lone event.
  static constexpr Id kNoPartner = std::numeric_limits<Id>::max();
  Id partner() const {
    if (key.kind != EventKind::pair) return kNoPartner;
    return key.lo == after.id ? key.hi : key.lo;
  }
};

/// Whether two nodes are equal, bit for bit.
template <int D>
bool operator==(const Node<D>& a, const Node<D>& b) {
  return a.key == b.key && a.after.x == b.after.x && a.after.v == b.after.v && a.after.t == b.after.t &&
         a.after.id == b.after.id && a.internal == b.internal;
}

/// Thrown before an event for which the log has no room; the events in the log stay valid.
struct LogFull {};

template <int D>
class Trace {
 public:
  static constexpr std::uint32_t kNoEntry = 0xffffffff;

  /// An event of one sphere, or of two, the one with the lower id first.
  struct Event {
    double time, overlap;
    PackedExchange exchange;
    std::uint16_t generation;
    EventKind kind;
    PairEvent pair_event;   ///< Exchange::event
    std::uint32_t partner;  ///< the partner of the first sphere, as in NextEvent
    Slot slot[2];           ///< the second one is kNoEntry in a lone event
    std::uint32_t last[2];  ///< the sphere's entry in its previous event, or kNoEntry
  };
  // Sphere k of an event, k = 0 or 1, has the entry number 2·event + k.

  /// Removes all events and makes room for this many slots. Speeds are relative to a flow with the velocity
  /// shear_rate·y along the first axis.
  void clear(std::size_t slots, double shear_rate) {
    shear_rate_ = shear_rate;
    base_ += 2 * static_cast<std::uint32_t>(size_);
    if (base_ > kNoEntry / 4) {
      std::fill(latest_.begin(), latest_.end(), 0);
      base_ = 1;
    }
    latest_.resize(slots, 0);
    size_ = 0;
    internal_before_.clear();
    fastest_squared_ = 0;
    most_ = kMaxEvents + kMaxEventsPerSphere * slots;
  }

  /// Call before an event of sphere `i`, and of sphere `j` unless `j` is kNoEntry.
  void begin(EventKind kind, Slot i, const Record<D>& a, Slot j, const Record<D>& b, std::uint32_t partner,
             std::uint32_t generation) {
    if (size_ == events_.size()) grow();
    Event& event = events_[size_];
    event.generation = static_cast<std::uint16_t>(generation);
    event.kind = kind;
    event.partner = partner;
    event.slot[0] = i;
    event.slot[1] = j;
    before_[2 * size_] = a;
    before_[2 * size_ + 1] = b;
    ++size_;
    if (size_ < events_.size()) {  // the log is larger than the caches near the core
      prefetch_to_write(&events_[size_] + 1);
      for (const std::size_t which : {0u, 1u}) prefetch_to_write(&before_[2 * size_ + which]);
    }
  }
  /// Call after begin() if spheres have an internal state.
  void note_internal(const Internal<D>& a, const Internal<D>& b) {
    internal_before_.insert(internal_before_.end(), {a, b});
  }
  /// Call after the event.
  void end(const Record<D>& a, const Record<D>& b, const Exchange& exchange, double overlap) {
    Event& event = events_[size_ - 1];
    event.time = a.t;
    event.exchange = {event.kind, exchange};
    event.pair_event = exchange.event;
    event.overlap = overlap;
    note_speed(a);
    note_speed(b);
  }
  /// Call for a sphere after an event that is not in the log.
  void note_speed(const Record<D>& r) {
    Vec<D> v = r.v;
    v[0] -= shear_rate_ * r.x[1];
    fastest_squared_ = std::max(fastest_squared_, v.squaredNorm());
  }

  /// Links the entries of each sphere, which the functions below require; calls visit(slot, first) at each and, some
  /// events earlier, prefetch(slot). In one pass over the complete log the memory of many spheres is fetched at once;
  /// event by event, each would be waited for.
  template <class Prefetch, class Visit>
  void link(Prefetch&& prefetch, Visit&& visit) {
    constexpr std::size_t kAhead = 8;
    for (std::size_t n = 0; n < size_; ++n) {
      if (n + kAhead < size_)
        for (const Slot i : events_[n + kAhead].slot)
          if (i != kNoEntry) prefetch_line(&latest_[i]), prefetch(i);
      for (const std::uint32_t which : {0u, 1u}) {
        const Slot i = events_[n].slot[which];
        if (i == kNoEntry) continue;
        const bool first = !has(i);
        events_[n].last[which] = first ? kNoEntry : latest_[i] - base_;
        latest_[i] = base_ + 2 * static_cast<std::uint32_t>(n) + which;
        visit(i, first);
      }
    }
  }

  std::span<const Event> events() const { return {events_.data(), size_}; }
  const Event& event_of(std::uint32_t entry) const { return events_[entry / 2]; }
  /// The sphere's record before its entry in an event; the first sphere has the even entry.
  const Record<D>& before(std::uint32_t entry) const { return before_[entry]; }
  /// Its internal state before; zero if none was noted.
  Internal<D> internal_before(std::uint32_t entry) const {
    return internal_before_.empty() ? Internal<D>{} : internal_before_[entry];
  }
  bool has(Slot i) const { return latest_[i] >= base_; }
  /// The entries of a sphere in order of time; valid until the next call.
  std::span<const std::uint32_t> entries(Slot i) const {
    entries_.clear();
    for (std::uint32_t entry = has(i) ? latest_[i] - base_ : kNoEntry; entry != kNoEntry;
         entry = event_of(entry).last[entry % 2])
      entries_.push_back(entry);
    std::reverse(entries_.begin(), entries_.end());
    return entries_;
  }
  double fastest_squared() const { return fastest_squared_; }  ///< over all spheres, after events

 private:
  // The capacity of a log: a window has less than 0.1 events a sphere (kCollisionsPerWindow in window_length.cc).
  static constexpr std::size_t kMaxEvents = 20'000, kMaxEventsPerSphere = 16;

  [[gnu::noinline]] void grow() {
    if (size_ >= most_) throw LogFull{};
    events_.resize(std::min(most_, 2 * size_ + 1000));
    before_.resize(2 * events_.size());
  }

  std::vector<Event> events_;                 // the first size_ are used
  PageVector<Record<D>> before_;              // by entry
  std::vector<Internal<D>> internal_before_;  // by entry; empty if spheres have none
  std::vector<std::uint32_t> latest_;         // by slot: base_ + entry; smaller values are from earlier windows
  std::uint32_t base_ = 1;
  std::size_t size_ = 0, most_ = 0;
  double fastest_squared_ = 0, shear_rate_ = 0;
  mutable std::vector<std::uint32_t> entries_;
};

}  // namespace carom
