// SPDX-License-Identifier: BSD-3-Clause
#include "engine/events/event_queue.h"

#include "engine/events/contact.h"

namespace carom {

template <int D>
void EventQueue<D>::clear() {
  next_events_.clear();
  next_events_.reserve(flights_.capacity());
  next_events_.assign(flights_.size(), NextEvent<D>{});
}

template <int D>
void EventQueue<D>::admit(Slot i) {
  if (i == next_events_.size()) next_events_.emplace_back();
  ++next_events_[i].version;
}

template <int D>
void EventQueue<D>::fill(double now, double horizon, double entries_per_bin) {
  constexpr std::size_t kSample = 8192;
  const std::size_t n = next_events_.size();
  std::vector<double> some;
  for (std::size_t i = 0; i < n; i += n / kSample + 1) some.push_back(next_events_[i].due());
  tied_ = {};
  calendar_.reset(horizon, n, entries_per_bin, std::move(some), now);
  for (std::size_t i = 0; i < n; ++i) schedule(static_cast<Slot>(i));
}

template <int D>
EventKey<D> EventQueue<D>::key_of(Slot i) const {
  const NextEvent<D>& a = next_events_[i];
  const Record<D>& r = flights_[i];
  if (a.kind != EventKind::pair)
    return {.time = a.contact, .generation = generation_of(i), .kind = a.kind, .lo = r.id, .hi = a.partner};
  const Id other = flights_[slot_of(a.partner)].id;
  return pair_key<D>(a.contact, generation_of(i), r.id, other, flights_.packing().image(a.partner));
}

template <int D>
void EventQueue<D>::offer(Slot i, double time, EventKind kind, std::uint32_t partner) {
  NextEvent<D>& a = next_events_[i];
  if (!(time <= a.contact) || time == kNever)
    return;  // A time that is NaN is ignored here; the monitor ends the run when it next checks the energy.
  const NextEvent<D> before = a;
  const EventKey<D> rival = time == a.contact ? key_of(i) : EventKey<D>{};
  a.contact = time;
  a.kind = kind;
  a.partner = partner;
  if (kind == EventKind::pair) a.partner_version = next_events_[slot_of(partner)].version;
  if (time == before.contact && !(key_of(i) < rival)) a = before;
}

template <int D>
typename EventQueue<D>::Tied EventQueue<D>::tie(Slot i) const {
  const NextEvent<D>& a = next_events_[i];
  if (a.update < a.contact) return {Tied::Rank::update, EventKey<D>{.lo = flights_[i].id}, i};
  return {stale(a) ? Tied::Rank::stale : Tied::Rank::contact, key_of(i), i};
}

/// Whether two spheres plan the same contact and it is valid.
template <int D>
bool EventQueue<D>::mirrored(Slot i, Slot j) const {
  const NextEvent<D>&a = next_events_[i], &b = next_events_[j];
  return a.kind == EventKind::pair && b.kind == EventKind::pair && b.contact == a.contact && a.contact <= a.update &&
         b.contact <= b.update && slot_of(a.partner) == j && b.partner == flights_.packing().reversed(i, a.partner) &&
         !stale(a) && !stale(b);
}

/// Called if several entries have this time. If the only other one is the partner's entry for the same contact, this
/// function removes that entry and returns true. Otherwise it puts the events into tied_, from which next_tied() takes
/// them in the order of their keys, and returns false.
template <int D>
bool EventQueue<D>::serve_alone(Slot slot, double time) {
  read_versions();  // stale plans must be recognised from here on
  // Often both partners planned the same contact: both plans are then served at once.
  Slot other = slot;
  if (const CalendarEntry* const next = calendar_.top(IsValid{next_events_.data()}); mirrored(slot, next->slot)) {
    other = next->slot;
    calendar_.pop();
    if (!calendar_.more_at(time)) return true;
  }
  tied_.push(tie(slot));
  if (other != slot) tied_.push(tie(other));
  tied_time_ = time;
  return false;
}

/// next() while several events at the same time are being put in order.
template <int D>
bool EventQueue<D>::next_tied(double end, Slot& slot, double& time) {
  const IsValid is_valid{next_events_.data()};
  while (!tied_.empty()) {
    read_versions();
    time = tied_time_;
    while (calendar_.more_at(time)) {
      const CalendarEntry* const top = calendar_.top(is_valid);
      if (is_valid(*top)) tied_.push(tie(top->slot));
      calendar_.pop();
    }
    const Tied first = tied_.top();
    tied_.pop();
    slot = first.slot;
    if (next_events_[slot].due() != time) continue;  // its plan has changed, and the new one is in the calendar
    const Tied now = tie(slot);
    if (now == first) return true;
    tied_.push(now);  // its partner has collided, so its key has changed
  }
  return next(end, slot, time);
}

template class EventQueue<2>;
template class EventQueue<3>;

}  // namespace carom
