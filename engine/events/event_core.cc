#include "engine/events/event_core.h"

#include <string>

#include "engine/base/error.h"
#include "engine/events/surroundings.h"

namespace carom {
template <int D>
EventCore<D>::EventCore(const Box<D>& box, const Sizes* sizes, const SearchOptions& options)
    : box_(box),
      sizes_(sizes),
      flights_(box),
      options_(options),
      kernels_(scan_kernels()),
      walled_(!box.walls().empty()),
      tuning_(options) {}

template <int D>
EventCore<D>::~EventCore() = default;

template <int D>
bool EventCore<D>::stale(const NextEvent<D>& a) const {
  return a.kind == EventKind::pair && next_events_[packing_.slot(a.partner)].version != a.partner_version;
}

/// Of the contact that is planned.
template <int D>
std::uint32_t EventCore<D>::generation_of(Slot i) const {
  const NextEvent<D>& a = next_events_[i];
  const std::uint32_t own = flights_.generation_at(i, a.contact);
  if (a.kind == EventKind::wall) return own;
  return std::max(own, flights_.generation_at(packing_.slot(a.partner), a.contact));
}

template <int D>
EventKey<D> EventCore<D>::key_of(Slot i) const {
  const NextEvent<D>& a = next_events_[i];
  const Record<D>& r = flights_[i];
  if (a.kind == EventKind::wall)
    return {.time = a.contact, .generation = generation_of(i), .kind = a.kind, .lo = r.id, .hi = a.partner};
  const Id other = flights_[packing_.slot(a.partner)].id;
  return pair_key<D>(a.contact, generation_of(i), r.id, other, packing_.image(a.partner));
}

template <int D>
typename EventCore<D>::Tied EventCore<D>::tie(Slot i) const {
  const NextEvent<D>& a = next_events_[i];
  if (a.update < a.contact) return {Tied::Rank::update, EventKey<D>{.lo = flights_[i].id}, i};
  return {stale(a) ? Tied::Rank::stale : Tied::Rank::contact, key_of(i), i};
}

/// Whether two spheres plan the same contact, and it still holds.
template <int D>
bool EventCore<D>::mirrored(Slot i, Slot j) const {
  const NextEvent<D>&a = next_events_[i], &b = next_events_[j];
  return a.kind == EventKind::pair && b.kind == EventKind::pair && b.contact == a.contact && a.contact <= a.update &&
         b.contact <= b.update && packing_.slot(a.partner) == j && b.partner == packing_.reversed(i, a.partner) &&
         !stale(a) && !stale(b);
}

/// The next event before `end`: the smallest time, and of equal times the smallest key.
template <int D>
bool EventCore<D>::next_event(double end, Slot& slot, double& time) {
  const auto holds = [&](const CalendarEntry& entry) { return next_events_[entry.slot].due() == entry.time; };
  for (;;) {
    if (tied_.empty()) {
      const CalendarEntry* const top = calendar_.top(holds);
      if (!top || top->time >= end) return false;
      const CalendarEntry entry = *top;
      calendar_.pop();
      if (!holds(entry)) {
        ++counts_.dropped;
        continue;
      }
      slot = entry.slot;
      time = entry.time;
      if (!calendar_.more_at(time)) return true;
      settle();  // from here on it matters which plans are stale
      // Often it is the same contact, planned by both partners: the other's plan falls with this one.
      Slot other = slot;
      if (const CalendarEntry* const next = calendar_.top(holds); mirrored(slot, next->slot)) {
        other = next->slot;
        calendar_.pop();
        if (!calendar_.more_at(time)) return true;
      }
      tied_.push(tie(slot));
      if (other != slot) tied_.push(tie(other));
      tied_time_ = time;
    }
    settle();
    time = tied_time_;
    while (calendar_.more_at(time)) {
      const CalendarEntry* const top = calendar_.top(holds);
      if (holds(*top)) tied_.push(tie(top->slot));
      calendar_.pop();
    }
    const Tied first = tied_.top();
    tied_.pop();
    slot = first.slot;
    if (next_events_[slot].due() != time) continue;  // its plans have changed, and its new ones are in the calendar
    const Tied now = tie(slot);
    if (now == first) return true;
    tied_.push(now);  // what it plans has another place among these: its partner has collided
  }
}

/// A contact holds while its partner's version is the one it was planned with. Versions are read an event after the
/// plans were made, because they come from memory.
template <int D>
void EventCore<D>::settle() {
  for (; planned_ > 0; --planned_) {
    NextEvent<D>& a = next_events_[just_planned_[planned_ - 1]];
    if (a.kind == EventKind::pair) a.partner_version = next_events_[packing_.slot(a.partner)].version;
  }
}

template <int D>
double EventCore<D>::run(double end, const Report& report) {
  Slot i;
  double now;
  while (next_event(end, i, now)) {
    now_ = now;
    if (!small_) prefetch_upcoming();
    settle();
    NextEvent<D>& a = next_events_[i];
    if (a.update < a.contact) {
      update(i, now);
      continue;
    }
    if (stale(a)) {
      ++counts_.stale;
      predict(i, now);
      continue;
    }
    ++since_sort_;
    const std::uint32_t generation = generation_of(i);
    if (generation > std::numeric_limits<std::uint16_t>::max())
      throw Error(Failure::numerical,
                  partners(key_of(i)) + " collide without end at one instant; separate the spheres that touch there");
    if (++events_ > report.max_events) throw_too_many_contacts(report.max_events, partners(key_of(i)));
    if (a.kind == EventKind::wall) {
      collide_wall(i, now, generation, report);
      predict(i, now);
      continue;
    }
    const Slot j = packing_.slot(a.partner);
    collide_pair(i, now, generation, report);
    predict_two(i, j, now);
    if (report.counters.sphere_sphere >= report.collision_limit) {
      settle();
      return now;
    }
  }
  settle();
  return end;
}

template <int D>
void EventCore<D>::fly_to(double time, Particles<D>& copies) const {
  copies.x.resize(flights_.size());
  copies.v.resize(flights_.size());
  for (Slot i = 0; i < flights_.size(); ++i) {
    const Record<D> r = flights_.at(i, time);
    copies.x[r.id] = r.x;
    copies.v[r.id] = r.v;
  }
}

/// Finds the next contact of a sphere after a change of its record, or its partner's, and puts it into the calendar.
template <int D>
void EventCore<D>::predict(Slot i, double now) {
  foresee(i, now);
  schedule(i);
}

template <int D>
void EventCore<D>::foresee(Slot i, double now) {
  ++counts_.predictions;
  NextEvent<D>& a = next_events_[i];
  a.contact = kNever;
  if (lists_) {
    predict_pairs({i, lists_->candidates(a), a.count, a.same}, flights_[i].t == now);
  } else {
    cells_->around(i, a.where.cell, found_);
    predict_pairs({i, found_.packed.data(), found_.count, found_.same}, flights_[i].t == now);
  }
  if (walled_) predict_walls(i);
  predict_update(i, now);
}

/// The same for two spheres that have just collided.
template <int D>
void EventCore<D>::predict_two(Slot i, Slot j, double now) {
  counts_.predictions += 2;
  NextEvent<D>&a = next_events_[i], &b = next_events_[j];
  ScanTask task[2];
  if (lists_) {
    task[0] = {i, lists_->candidates(a), a.count, a.same};
    task[1] = {j, lists_->candidates(b), b.count, b.same};
  } else {
    cells_->around(i, a.where.cell, found_);
    cells_->around(j, b.where.cell, others_);
    task[0] = {i, found_.packed.data(), found_.count, found_.same};
    task[1] = {j, others_.packed.data(), others_.count, others_.same};
  }
  counts_.candidates += task[0].n + task[1].n;
  ScanResult first[2];
  kernels_.scan_two[D - 2](setting_, task, first);
  a.contact = b.contact = kNever;
  for (const int k : {0, 1}) {
    const Slot one = task[k].self;
    take(task[k], first[k]);
    if (walled_) predict_walls(one);
    predict_update(one, now);
    schedule(one);
  }
}

/// Plans the first contact with the candidates where it comes before the one that is planned. `latest`: no record is of
/// a later time than the sphere's own.
template <int D>
void EventCore<D>::predict_pairs(const ScanTask& task, bool latest) {
  counts_.candidates += task.n;
  take(task, kernels_.scan[D - 2](setting_, task, latest));
}

template <int D>
void EventCore<D>::take(const ScanTask& task, const ScanResult& first) {
  NextEvent<D>& a = next_events_[task.self];
  if (first.time > a.contact || first.time == kNever) return;
  if (first.tied || first.time == a.contact || first.time == -kNever) return predict_pairs_one_by_one(task);
  a.contact = first.time;
  a.kind = EventKind::pair;
  a.partner = task.candidates[first.which];
  prefetch_line(&next_events_[packing_.slot(a.partner)]);
  just_planned_[planned_++] = task.self;
}

template <int D>
void EventCore<D>::predict_pairs_one_by_one(const ScanTask& task) {
  const Slot i = task.self;
  NextEvent<D>& a = next_events_[i];
  for (unsigned q = 0; q < task.n; ++q) {
    const std::uint32_t candidate = task.candidates[q];
    const Slot j = packing_.slot(candidate);
    if (j == i) continue;
    const double time = flights_.pair_contact(i, j, box_.shift(packing_.image(candidate)));
    if (time > a.contact || time == kNever) continue;
    const NextEvent<D> before = a;
    const bool first = before.contact == kNever;
    const EventKey<D> rival = first ? EventKey<D>{} : key_of(i);
    a.contact = time;
    a.kind = EventKind::pair;
    a.partner = candidate;
    a.partner_version = next_events_[j].version;
    if (!first && !(key_of(i) < rival)) a = before;
  }
}

template <int D>
void EventCore<D>::predict_walls(Slot i) {
  NextEvent<D>& a = next_events_[i];
  for (const Wall<D>& wall : flights_.walls()) {
    const double time = flights_.wall_contact(i, wall);
    if (time > a.contact || time == kNever) continue;
    const NextEvent<D> before = a;
    const bool first = before.contact == kNever;
    const EventKey<D> rival = first ? EventKey<D>{} : key_of(i);
    a.contact = time;
    a.kind = EventKind::wall;
    a.partner = wall.number();
    if (!first && !(key_of(i) < rival)) a = before;
  }
}

template <int D>
void EventCore<D>::predict_update(Slot i, double now) {
  if (lists_)
    predict_leaving(next_events_[i], flights_[i], flights_, room(i), now);
  else
    predict_crossing(next_events_[i], i, flights_, box_, cells_->grid(), now);
}

/// How far a sphere may go from the centre of its list's region.
template <int D>
double EventCore<D>::room(Slot i) const {
  return lists_->skin() - (!at_border_.empty() && at_border_[i] != 0 ? max_displacement_ : 0);
}

template <int D>
void EventCore<D>::schedule(Slot i) {
  calendar_.push(next_events_[i].due(), i);
  ++counts_.scheduled;
}

/// The surroundings of a sphere must be looked at again.
template <int D>
void EventCore<D>::update(Slot i, double now) {
  if (!lists_) return cross(i, now);
  const Record<D> r = flights_.at(i, now);
  NextEvent<D>& a = next_events_[i];
  if (flights_.field()) {  // it may still be far from where its list ends
    Vec<D> e;
    for (int k = 0; k < D; ++k) e[k] = r.x[k] - a.where.centre[k];
    if (e.norm() < 0.7 * room(i)) {
      predict_update(i, now);
      schedule(i);
      return;
    }
  }
  ++counts_.rebuilds;
  const std::span<const std::uint32_t> fresh = lists_->renew(i, r.x);
  // The planned contact stands; only those that are new in the list are looked at.
  if (!fresh.empty()) predict_pairs({i, fresh.data(), static_cast<unsigned>(fresh.size()), 0}, false);
  predict_leaving(next_events_[i], flights_[i], flights_, room(i), now);
  schedule(i);
}

/// Moves a sphere into the next cell. Its contact stands; only the cells that have come into view are searched.
template <int D>
void EventCore<D>::cross(Slot i, double now) {
  ++counts_.crossings;
  NextEvent<D>& a = next_events_[i];
  const int axis = a.face / 2, step = a.face % 2 == 1 ? 1 : -1;
  cells_->cross(i, a.where.cell, axis, step);
  cells_->ahead(i, a.where.cell, axis, step, found_);
  if (found_.count > 0) predict_pairs({i, found_.packed.data(), found_.count, found_.same}, false);
  predict_update(i, now);
  schedule(i);
}

template <int D>
void EventCore<D>::collide_pair(Slot i, double time, std::uint32_t generation, const Report& report) {
  NextEvent<D>& plan = next_events_[i];
  const Slot j = packing_.slot(plan.partner);
  if (report.trace) {
    if (flights_[i].id < flights_[j].id)
      report.trace->begin(i, flights_[i], j, flights_[j], plan.partner, generation);
    else
      report.trace->begin(j, flights_[j], i, flights_[i], packing_.reversed(i, plan.partner), generation);
  }
  EventKey<D> key;
  if (report.contacts) key = key_of(i);
  Vec<D> shift = Vec<D>::Zero();
  if (packing_.linear(plan.partner) != 0) shift = box_.shift(packing_.image(plan.partner));
  const Blow<D> blow = flights_.collide(i, j, shift, time, generation);
  ++plan.version;
  ++next_events_[j].version;
  const double virial = blow.d.dot(blow.impulse);
  if (report.trace) return report.trace->end(flights_[i], flights_[j], virial, blow.overlap);
  report.counters.add(EventKind::pair, virial, blow.overlap);
  if (report.contacts) report.contacts->push_back(flights_.contact_of(key, flights_[i], flights_[j], shift, blow));
}

template <int D>
void EventCore<D>::collide_wall(Slot i, double time, std::uint32_t generation, const Report& report) {
  const EventKey<D> key = key_of(i);
  if (report.trace) report.trace->begin(i, flights_[i], Trace<D>::kNone, flights_[i], key.hi, generation);
  const Wall<D> wall = box_.wall(key.hi);
  const Blow<D> blow = flights_.bounce(i, wall, time, generation);
  ++next_events_[i].version;
  const double work = wall.work(blow.impulse);
  if (report.trace) return report.trace->end(flights_[i], flights_[i], work, blow.overlap);
  report.counters.add(EventKind::wall, work, blow.overlap);
  if (report.contacts) report.contacts->push_back(flights_.contact_of(key, flights_[i], blow));
}

template class EventCore<2>;
template class EventCore<3>;

}  // namespace carom
