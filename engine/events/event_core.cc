// SPDX-License-Identifier: BSD-3-Clause
#include "engine/events/event_core.h"

#include <string>

#include "engine/base/error.h"
#include "engine/events/contact.h"
#include "engine/search/curve.h"

namespace carom {

template <int D>
EventCore<D>::EventCore(const Box<D>& box, const Sizes* sizes, const SearchOptions& options)
    : box_(box),
      sizes_(sizes),
      sort_interval_(options.sort_interval),
      flights_(box),
      queue_(flights_),
      search_(box, flights_, queue_, sizes, options) {}

template <int D>
EventCounts EventCore<D>::counts() const {
  EventCounts all = search_.counts();
  all += queue_.counts();
  all.stale += stale_;
  return all;
}

template <int D>
void EventCore<D>::load(const Particles<D>& particles, const Vec<D>& g, double horizon, double growth) {
  read(particles, g, horizon, growth);
  search_.start(0, 0);
}

template <int D>
void EventCore<D>::take(Particles<D>& particles, const Vec<D>& g, double horizon, double growth) {
  read(particles, g, horizon, growth);
  std::vector<Vec<D>>().swap(particles.x);
  std::vector<Vec<D>>().swap(particles.v);
  search_.start(0, 0);
}

template <int D>
void EventCore<D>::give_back(double time, Particles<D>& particles) {
  queue_.empty();  // frees memory
  copy_at(time, particles);
}

/// Loads the records, sorted in space again if that is due.
template <int D>
void EventCore<D>::read(const Particles<D>& particles, const Vec<D>& g, double horizon, double growth) {
  const std::size_t n = particles.size();
  events_ = 0;
  now_ = 0;
  if (flights_.size() != n || static_cast<double>(since_sort_) > sort_interval_ * static_cast<double>(n)) {
    search_.clear();
    flights_.assign(along_curve<D>(n, [&](std::size_t i) -> const Vec<D>& { return particles.x[i]; }));
    since_sort_ = 0;
  }
  flights_.load(particles, g, horizon, growth);
}

template <int D>
void EventCore<D>::load(std::vector<Record<D>> records, const Vec<D>& g, double horizon, double now,
                        double max_displacement, const std::vector<Internal<D>>& internal) {
  const auto order = along_curve<D>(records.size(), [&](std::size_t i) -> const Vec<D>& { return records[i].x; });
  events_ = since_sort_ = 0;
  now_ = now;
  free_.clear();
  search_.clear();
  flights_.load(records, *sizes_, g, horizon, internal, order);
  std::vector<Record<D>>().swap(records);
  search_.start(now, max_displacement);
}

template <int D>
bool EventCore<D>::admit(const Record<D>& r, const Internal<D>& internal, double now, Slot& slot) {
  if (!free_.empty()) {
    slot = free_.back();
    free_.pop_back();
  } else {
    if (flights_.size() == flights_.capacity()) return false;
    slot = static_cast<Slot>(flights_.size());
  }
  const double radius = sizes_->radius_of(r);
  flights_.admit(slot, r, radius, sizes_->mass_of(r), internal);
  queue_.admit(slot);
  search_.admit(slot, box_.steps.reach()(radius), now);
  queue_.read_versions();
  return true;
}

template <int D>
void EventCore<D>::dismiss(Slot i) {
  NextEvent<D>& a = queue_[i];
  ++a.version;  // contacts planned with it are stale
  a.contact = a.update = kNever;
  search_.dismiss(i);
  free_.push_back(i);
}

template <int D>
void EventCore<D>::put(std::span<const Changed> spheres, double now) {
  for (const auto& [i, r, internal] : spheres) {
    flights_.set(i, r, internal);
    ++queue_[i].version;
  }
  for (const Changed& each : spheres) search_.move(each.slot, now);
  for (const Changed& each : spheres) {
    search_.plan(each.slot, now);
    queue_.read_versions();
  }
}

template <int D>
double EventCore<D>::run(double end, const Report& report) {
  Slot i;
  double now;
  while (queue_.next(end, i, now)) {
    now_ = now;
    search_.prefetch();
    queue_.read_versions();
    NextEvent<D>& a = queue_[i];
    if (a.update < a.contact) {
      search_.look_again(i, now);
      continue;
    }
    if (queue_.stale(a)) {
      ++stale_;
      search_.plan(i, now);
      continue;
    }
    ++since_sort_;
    const std::uint32_t generation = queue_.generation_of(i);
    if (generation > std::numeric_limits<std::uint16_t>::max())
      throw Error(Failure::numerical, partners(queue_.key_of(i), box_) +
                                          " collide without end at one instant; separate the spheres that touch there");
    if (++events_ > report.max_events)
      throw_too_many_contacts(box_.contacts, report.max_events, partners(queue_.key_of(i), box_));
    if (a.kind == EventKind::pair) {
      const Slot j = flights_.packing().slot(a.partner);
      collide_pair(i, j, a.partner, now, generation, report);
      search_.plan_two(i, j, now);
    } else {
      meet_alone(i, generation, report);
      search_.plan(i, now);
    }
    if (report.counters.sphere_sphere >= report.collision_limit || events_ >= report.contact_limit) {
      end = now;
      break;
    }
  }
  queue_.read_versions();
  return end;
}

template <int D>
void EventCore<D>::copy_at(double time, Particles<D>& copies) const {
  copies.x.resize(flights_.size());
  copies.v.resize(flights_.size());
  for (Slot i = 0; i < flights_.size(); ++i) {
    const Record<D> r = flights_.at(i, time);
    copies.x[r.id] = r.x;
    copies.v[r.id] = r.v;
  }
  if (!flights_.has_internal()) return;
  copies.resize_internal(flights_.size());
  for (Slot i = 0; i < flights_.size(); ++i) copies.set_internal(flights_[i].id, flights_.internal(i));
}

template <int D>
void EventCore<D>::begin_trace(Slot i, std::uint32_t partner, std::uint32_t generation, Trace<D>& trace) const {
  const Slot j = flights_.packing().slot(partner);
  const auto [lo, hi] = flights_[i].id < flights_[j].id ? std::pair(i, j) : std::pair(j, i);
  trace.begin(EventKind::pair, lo, flights_[lo], hi, flights_[hi],
              lo == i ? partner : flights_.packing().reversed(i, partner), generation);
  if (flights_.has_internal()) trace.note_internal(flights_.internal(lo), flights_.internal(hi));
}

template <int D>
void EventCore<D>::collide_pair(Slot i, Slot j, std::uint32_t partner, double time, std::uint32_t generation,
                                const Report& report) {
  const Packing<D>& packing = flights_.packing();
  if (report.trace) begin_trace(i, partner, generation, *report.trace);
  const Offset<D> offset = packing.linear(partner) != 0 ? box_.offset(packing.image(partner)) : Offset<D>{};
  const EventResult<D> result = flights_.collide(i, j, offset, time, generation);
  ++queue_[i].version;
  ++queue_[j].version;
  if (report.trace) return report.trace->end(flights_[i], flights_[j], result.exchange, result.overlap);
  report.counters.add_pair(result.exchange);
  const auto key = [&] {
    return pair_key<D>(time, generation, flights_[i].id, flights_[j].id, packing.image(partner));
  };
  report.counters.note_overlap(result.overlap, [&] { return Overlap(result.overlap, result.sigma, key()); });
  if (report.contacts) report.contacts->push_back(flights_.contact_of(key(), flights_[i], flights_[j], offset, result));
}

template <int D>
void EventCore<D>::meet_alone(Slot i, std::uint32_t generation, const Report& report) {
  const EventKey<D> key = queue_.key_of(i);
  if (report.trace) {
    report.trace->begin(key.kind, i, flights_[i], Trace<D>::kNoEntry, flights_[i], key.hi, generation);
    if (flights_.has_internal()) report.trace->note_internal(flights_.internal(i), flights_.internal(i));
  }
  const EventResult<D> result = flights_.meet_alone(key, i);
  ++queue_[i].version;
  if (report.trace) return report.trace->end(flights_[i], flights_[i], result.exchange, result.overlap);
  report.counters.add(key.kind, key.hi, result.exchange);
  report.counters.note_overlap(result.overlap, [&] { return Overlap(result.overlap, result.sigma, key); });
  if (report.contacts) report.contacts->push_back(flights_.contact_of(key, flights_[i], result));
}

template class EventCore<2>;
template class EventCore<3>;

}  // namespace carom
