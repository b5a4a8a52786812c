// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// What every sphere plans next, in the order in which it happens.
//
// Each sphere has one entry that holds; entries that no longer do are left out when they come up (calendar.h). Times
// are compared first. Events at one instant are in the order of their keys, stale plans first, because what they hide
// may come before the others.

#include <queue>

#include "engine/base/event_counts.h"
#include "engine/base/prefetch.h"
#include "engine/events/calendar.h"
#include "engine/events/flights.h"
#include "engine/search/next_event.h"

namespace carom {

template <int D>
class EventQueue {
 public:
  explicit EventQueue(const Flights<D>& flights) : flights_(flights) {}

  /// Forgets all plans, and has one for each sphere that there is now.
  void clear();
  /// A sphere has been given a slot, one of those there are or the next.
  void admit(Slot i);
  /// Puts what all spheres plan into the queue, for times in [now, horizon); `entries_per_bin` as in the calendar.
  void fill(double now, double horizon, double entries_per_bin);
  /// Removes all entries from the queue; plans stay.
  void empty() { calendar_ = Calendar(); }

  NextEvent<D>& operator[](Slot i) { return next_events_[i]; }
  const NextEvent<D>& operator[](Slot i) const { return next_events_[i]; }
  PageVector<NextEvent<D>>& plans() { return next_events_; }

  /// Plans a contact of a sphere where it comes before the one that is planned; `partner` as in NextEvent.
  void offer(Slot i, double time, EventKind kind, std::uint32_t partner);
  /// The same for a contact with a candidate that is known to come first, for at most two spheres until settle().
  void plan_pair(Slot i, double time, std::uint32_t partner) {
    NextEvent<D>& a = next_events_[i];
    a.contact = time;
    a.kind = EventKind::pair;
    a.partner = partner;
    prefetch_line(&next_events_[slot_of(partner)]);
    just_planned_[planned_++] = i;
  }
  /// A contact holds while its partner's version is the one it was planned with. Versions are read an event after the
  /// plans were made, because they come from memory.
  void settle() {
    for (; planned_ > 0; --planned_) {
      NextEvent<D>& a = next_events_[just_planned_[planned_ - 1]];
      if (a.kind == EventKind::pair) a.partner_version = next_events_[slot_of(a.partner)].version;
    }
  }
  /// Puts what a sphere plans now into the queue.
  void schedule(Slot i) {
    calendar_.push(next_events_[i].due(), i);
    ++counts_.scheduled;
  }

  /// Takes out the next event before `end`; false: there is none.
  bool next(double end, Slot& slot, double& time);
  /// The entry that comes up so many places later, as far as is known; null where it is not.
  const CalendarEntry* upcoming(std::size_t ahead) const { return calendar_.upcoming(ahead); }

  /// Whether the partner has collided since the contact was planned.
  bool stale(const NextEvent<D>& a) const {
    return a.kind == EventKind::pair && next_events_[slot_of(a.partner)].version != a.partner_version;
  }
  /// Of the contact that is planned.
  std::uint32_t generation_of(Slot i) const {
    const NextEvent<D>& a = next_events_[i];
    const std::uint32_t own = flights_.generation_at(i, a.contact);
    return a.kind == EventKind::wall ? own : std::max(own, flights_.generation_at(slot_of(a.partner), a.contact));
  }
  EventKey<D> key_of(Slot i) const;

  const EventCounts& counts() const { return counts_; }

 private:
  /// An event among several at one time, with what it was when it was found there.
  struct Tied {
    enum class Rank : std::uint8_t { stale, contact, update } rank;
    EventKey<D> key;
    Slot slot;
    bool operator<(const Tied& other) const {  // std::priority_queue keeps the largest on top
      return rank != other.rank ? rank > other.rank : other.key < key;
    }
    bool operator==(const Tied& other) const { return rank == other.rank && key == other.key; }
  };

  Slot slot_of(std::uint32_t partner) const { return flights_.packing().slot(partner); }
  bool mirrored(Slot i, Slot j) const;
  Tied tie(Slot i) const;

  const Flights<D>& flights_;
  PageVector<NextEvent<D>> next_events_;
  Calendar calendar_;
  std::priority_queue<Tied> tied_;  // events at one and the same time, in the order of their keys
  double tied_time_ = 0;
  Slot just_planned_[2]{};  // in the last event: their partners' versions are still to be read
  unsigned planned_ = 0;    // how many
  EventCounts counts_;
};

}  // namespace carom
