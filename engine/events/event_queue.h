// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The planned events of all spheres, in the order in which they happen.
//
// Each sphere has one valid entry; invalid entries are skipped when they come up (calendar.h). Entries are ordered by
// time. Events at the same time are ordered by key, stale plans first, because the contacts found in their place may
// have earlier keys.

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

  /// Resets the plans, one for each sphere of the flights.
  void clear();
  /// Adds a sphere; its slot is an existing one or the next.
  void admit(Slot i);
  /// Schedules the plans of all spheres for times in [now, horizon); `entries_per_bin` as in the calendar.
  void fill(double now, double horizon, double entries_per_bin);
  /// Removes all entries from the calendar; plans stay.
  void empty() { calendar_ = Calendar(); }
  /// Frees the memory for entries and plans until clear().
  void release() {
    empty();
    PageVector<NextEvent<D>>().swap(next_events_);
  }

  NextEvent<D>& operator[](Slot i) { return next_events_[i]; }
  const NextEvent<D>& operator[](Slot i) const { return next_events_[i]; }
  PageVector<NextEvent<D>>& plans() { return next_events_; }

  /// Plans a contact of a sphere if it is earlier than the planned one; `partner` as in NextEvent.
  void offer(Slot i, double time, EventKind kind, std::uint32_t partner);
  /// Plans a contact that is known to be the earliest; at most four times before each read_versions().
  void plan_pair(Slot i, double time, std::uint32_t partner) {
    NextEvent<D>& a = next_events_[i];
    a.contact = time;
    a.kind = EventKind::pair;
    a.partner = partner;
    prefetch_line(&next_events_[slot_of(partner)]);
    just_planned_[planned_++] = i;
  }
  /// Stores the partner's version in the plans just made: a contact is valid while the version is unchanged. The
  /// versions are read one event later, when prefetching has brought them into the cache.
  void read_versions() {
    for (; planned_ > 0; --planned_) {
      NextEvent<D>& a = next_events_[just_planned_[planned_ - 1]];
      if (a.kind == EventKind::pair) a.partner_version = next_events_[slot_of(a.partner)].version;
    }
  }
  /// Schedules the planned event of a sphere.
  void schedule(Slot i) {
    calendar_.push(next_events_[i].due(), i);
    ++counts_.scheduled;
  }

  /// Removes and returns the next event before `end`; false if there is none.
  [[gnu::always_inline]] bool next(double end, Slot& slot, double& time) {
    while (tied_.empty()) {
      const CalendarEntry* const top = calendar_.top(IsValid{next_events_.data()});
      if (!top || top->time >= end) return false;
      slot = top->slot;
      time = top->time;
      calendar_.pop();
      if (next_events_[slot].due() != time)
        ++counts_.dropped;
      else if (!calendar_.more_at(time) || serve_alone(slot, time))
        return true;
    }
    return next_tied(end, slot, time);
  }
  const CalendarEntry* upcoming(std::size_t ahead) const { return calendar_.upcoming(ahead); }

  /// Whether the partner has collided since the contact was planned.
  bool stale(const NextEvent<D>& a) const {
    return a.kind == EventKind::pair && next_events_[slot_of(a.partner)].version != a.partner_version;
  }
  /// The generation of the planned contact.
  std::uint32_t generation_of(Slot i) const {
    const NextEvent<D>& a = next_events_[i];
    const std::uint32_t own = flights_.generation_at(i, a.contact);
    return a.kind == EventKind::pair ? std::max(own, flights_.generation_at(slot_of(a.partner), a.contact)) : own;
  }
  EventKey<D> key_of(Slot i) const;

  const EventCounts& counts() const { return counts_; }

 private:
  /// One of several events at the same time, as it was when found.
  struct Tied {
    enum class Rank : std::uint8_t { stale, contact, update } rank;
    EventKey<D> key;
    Slot slot;
    bool operator<(const Tied& other) const {  // std::priority_queue has the largest on top
      return rank != other.rank ? rank > other.rank : other.key < key;
    }
    bool operator==(const Tied& other) const { return rank == other.rank && key == other.key; }
  };

  /// Whether an entry of the calendar is that of a plan.
  struct IsValid {
    const NextEvent<D>* plans;
    bool operator()(const CalendarEntry& entry) const { return plans[entry.slot].due() == entry.time; }
  };

  bool serve_alone(Slot slot, double time);
  bool next_tied(double end, Slot& slot, double& time);
  Slot slot_of(std::uint32_t partner) const { return flights_.packing().slot(partner); }
  bool mirrored(Slot i, Slot j) const;
  Tied tie(Slot i) const;

  const Flights<D>& flights_;
  PageVector<NextEvent<D>> next_events_;
  Calendar calendar_;
  std::priority_queue<Tied> tied_;  // events at the same time, in the order of their keys
  double tied_time_ = 0;
  Slot just_planned_[4]{};  // spheres planned in the last event; their partners' versions must still be read
  unsigned planned_ = 0;    // their number
  EventCounts counts_;
};

}  // namespace carom
