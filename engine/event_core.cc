#include "engine/event_core.h"

#include <string>

#include "engine/collision.h"
#include "engine/contact.h"
#include "engine/error.h"

namespace carom {

template <int D>
EventCore<D>::EventCore(const Box<D>& box, const Particles<D>& particles) : box_(box), particles_(particles) {}

template <int D>
EventCore<D>::~EventCore() = default;

template <int D>
void EventCore<D>::load(const Particles<D>& particles, const Vec<D>& g, double horizon, double growth) {
  const std::size_t n = particles.size();
  g_ = g;
  field_ = g != Vec<D>::Zero();
  horizon_ = horizon;
  growth_ = growth;
  events_ = 0;
  expected_ = scheduled_;
  scheduled_ = 0;
  records_.resize(n);
  version_.resize(n, 0);
  pending_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    records_[i] = {particles.x[i], particles.v[i], 0.0, static_cast<Id>(i), 0, particles.species[i]};
    ++version_[i];
  }
  double largest_radius = 0;
  for (double r : particles_.radius) largest_radius = std::max(largest_radius, r);
  grid_ = std::make_unique<CellGrid<D>>(box_, 2 * grown(largest_radius, horizon), particles.x);
  first_.assign(grid_->cells(), kNobody);
  next_.assign(n, kNobody);
  previous_.assign(n, kNobody);
  cell_.resize(n);
  for (std::size_t i = n; i-- > 0;) {
    cell_[i] = grid_->cell(particles.x[i]);
    insert(static_cast<Id>(i), grid_->index(cell_[i]));
  }
  tied_ = {};
  calendar_.reset(horizon, std::max(expected_, n));
  for (std::size_t i = 0; i < n; ++i) predict(static_cast<Id>(i), 0.0);
}

/// Takes the next valid entry before `end` from the calendar: the smallest time, and of equal times the smallest key.
template <int D>
bool EventCore<D>::next_event(double end, CalendarEntry& entry) {
  const auto tie = [&] {
    const CalendarEntry& top = *calendar_.top();
    const Pending& pending = pending_[top.slot];
    if (valid(top)) tied_.push({top, pending.crosses_first(), pending.contact});
    calendar_.pop();
  };
  for (;;) {
    if (tied_.empty()) {
      const CalendarEntry* top = calendar_.top();
      if (!top || top->time >= end) return false;
      entry = *top;
      calendar_.pop();
      if (!valid(entry)) {
        ++counts_.dropped;
        continue;
      }
      top = calendar_.top();
      if (!top || top->time != entry.time) return true;
      tied_.push({entry, pending_[entry.slot].crosses_first(), pending_[entry.slot].contact});
    }
    const double now = tied_.top().entry.time;
    while (calendar_.top() && calendar_.top()->time == now) tie();
    entry = tied_.top().entry;
    tied_.pop();
    if (valid(entry)) return true;
  }
}

template <int D>
double EventCore<D>::run(double end, const Report& report) {
  for (CalendarEntry entry; next_event(end, entry);) {
    const Id i = entry.slot;
    const double event_time = entry.time;
    const Pending& pending = pending_[i];
    if (pending.crosses_first()) {
      cross(i);
      continue;
    }
    const EventKey<D> key = pending.contact;
    if (key.kind == EventKind::pair && version_[key.lo == i ? key.hi : key.lo] != pending.partner_version) {
      ++counts_.stale;
      predict(i, event_time);
      continue;
    }
    if (++events_ > report.max_events)
      throw Error(Failure::numerical, "more than max_events_per_step = " + std::to_string(report.max_events) +
                                          " collisions in one step, the last between " + partners(key) +
                                          "; use a smaller step or raise integrator.max_events_per_step");
    if (key.kind == EventKind::pair) {
      collide_pair(key, report);
      predict(key.lo, event_time);
      predict(key.hi, event_time);
      if (report.counters.sphere_sphere >= report.collision_limit) return event_time;
    } else {
      collide_wall(key, report);
      predict(key.lo, event_time);
    }
  }
  return end;
}

template <int D>
void EventCore<D>::fly_to(double time, Particles<D>& copies) const {
  for (std::size_t i = 0; i < records_.size(); ++i) {
    Record<D> r = records_[i];
    advance(r, time);
    copies.x[i] = r.x;
    copies.v[i] = r.v;
  }
}

template <int D>
void EventCore<D>::advance(Record<D>& r, double t) const {
  const double s = t - r.t;
  if (s != 0) {
    r.x += s * r.v;
    if (field_) {
      r.x += (0.5 * s * s) * g_;
      r.v += s * g_;
    }
  }
  r.t = t;
}

template <int D>
std::uint32_t EventCore<D>::generation_at(const Record<D>& r, double t) const {
  return r.t == t ? r.generation + 1u : 0u;
}

template <int D>
void EventCore<D>::predict(Id i, double now) {
  ++counts_.predictions;
  pending_[i].contact.time = kNever;
  Cell<D> low = cell_[i], high = cell_[i];
  for (int k = 0; k < D; ++k) --low[k], ++high[k];
  predict_pairs(i, low, high);
  predict_walls(i, pending_[i]);
  predict_crossing(i, now, pending_[i]);
  schedule(i);
}

/// Looks for contacts with whoever is in the cells from low to high.
template <int D>
void EventCore<D>::predict_pairs(Id i, const Cell<D>& low, const Cell<D>& high) {
  grid_->for_each_between(low, high, [&](std::size_t cell, const Image<D>& away) {
    for (Id j = first_[cell]; j != kNobody; j = next_[j]) {
      if (j == i) continue;
      ++counts_.candidates;
      Image<D> image;
      for (int k = 0; k < D; ++k) image[k] = grid_->boxes(k, cell_[j][k]) - away[k];
      predict_pair(i, j, image, pending_[i]);
    }
  });
}

template <int D>
void EventCore<D>::schedule(Id i) {
  Pending& pending = pending_[i];
  ++pending.stamp;
  const double time = std::min(pending.contact.time, pending.crossing);
  if (!(time < horizon_)) return;
  calendar_.push({time, i, pending.stamp});
  ++scheduled_;
  ++counts_.scheduled;
}

template <int D>
void EventCore<D>::predict_pair(Id i, Id j, const Image<D>& image_of_j, Pending& best) const {
  EventKey<D> key;
  key.kind = EventKind::pair;
  key.lo = std::min(i, j);
  key.hi = std::max(i, j);
  for (int k = 0; k < D; ++k) key.image[k] = i < j ? image_of_j[k] : -image_of_j[k];
  // A pure function of the two records: taken in id order, synchronised to the later of their times.
  const Record<D>&a = records_[key.lo], &b = records_[key.hi];
  const double now = std::max(a.t, b.t);
  const double s_a = now - a.t, s_b = now - b.t;
  Vec<D> d = (a.x + s_a * a.v) - (b.x + s_b * b.v);
  Vec<D> v = a.v - b.v;
  if (field_) {
    d += (0.5 * (s_a * s_a - s_b * s_b)) * g_;
    v += (s_a - s_b) * g_;
  }
  d += box_.shift(key.image);
  const double radii = particles_.radius[key.lo] + particles_.radius[key.hi];
  const double sigma = grown(radii, now), rate = radii * growth_;
  const bool apart = d.squaredNorm() > sigma * sigma;
  const double slack = apart ? 0 : approach_slack(sigma, a.v.norm(), b.v.norm() + rate);
  key.time = now + contact_time<D>(d, v, sigma, rate, slack);
  if (!(key.time <= best.contact.time) || key.time == kNever) return;
  key.generation = std::max(generation_at(a, key.time), generation_at(b, key.time));
  if (key < best.contact) {
    best.contact = key;
    best.partner_version = version_[j];
  }
}

template <int D>
void EventCore<D>::predict_walls(Id i, Pending& best) const {
  const Record<D>& r = records_[i];
  const double radius = grown(particles_.radius[i], r.t), rate = particles_.radius[i] * growth_;
  for (int k = 0; k < D; ++k) {
    if (!box_.walled(k)) continue;
    for (int side = 0; side < 2; ++side) {
      const double inward = side == 0 ? 1.0 : -1.0;
      const double gap = side == 0 ? r.x[k] - radius : box_.edges[k] - radius - r.x[k];
      const double opening = inward * r.v[k] - rate;
      const double tolerance = gap_tolerance(2 * radius, box_.edges[k]);
      const double slack = approach_slack(1.0, r.v.norm(), rate);
      const bool touching = gap <= tolerance;
      const double s = wall_contact_time(gap, opening, inward * g_[k], horizon_ - r.t, touching, slack);
      if (s == 0 && !(opening < -slack))
        throw Error(Failure::numerical,
                    "particle " + std::to_string(i) + " rests on the " + (side == 0 ? "lower" : "upper") +
                        " wall of axis " + std::to_string(k) +
                        " under the uniform field and would bounce without end; give it a height or a velocity");
      EventKey<D> key;
      key.time = r.t + s;
      if (!(key.time <= best.contact.time) || key.time == kNever) continue;
      key.kind = EventKind::wall;
      key.lo = i;
      key.hi = static_cast<Id>(2 * k + side);
      key.generation = generation_at(r, key.time);
      if (key < best.contact) best.contact = key;
    }
  }
}

template <int D>
void EventCore<D>::predict_crossing(Id i, double now, Pending& pending) const {
  Record<D> r = records_[i];
  advance(r, now);
  pending.crossing = kNever;
  for (int k = 0; k < D; ++k) {
    for (int side = 0; side < 2; ++side) {
      const std::int32_t c = cell_[i][k] + side;
      if (!box_.periodic(k) && (c <= 0 || c >= grid_->count(k))) continue;  // the outermost cells have no outer face
      const double outward = side == 1 ? 1.0 : -1.0;
      const double gap = outward * (grid_->face(k, c) - r.x[k]);  // to go until the face, ≥ 0 but for rounding
      const double s =
          wall_contact_time(std::max(gap, 0.0), -outward * r.v[k], -outward * g_[k], horizon_ - now, false, 0.0);
      // At least an ulp from now: at the top of its path a particle could cross back and forth in no time.
      const double t = std::max(now + s, std::nextafter(now, kNever));
      if (t < pending.crossing) {
        pending.crossing = t;
        pending.face = static_cast<std::uint8_t>(2 * k + side);
      }
    }
  }
}

/// Moves a particle into the next cell. Its contact stands; only the cells that have come into view are searched.
template <int D>
void EventCore<D>::cross(Id i) {
  ++counts_.crossings;
  Pending& pending = pending_[i];
  const double now = pending.crossing;
  const int axis = pending.face / 2, step = pending.face % 2 == 1 ? 1 : -1;
  remove(i);
  cell_[i][axis] += step;
  insert(i, grid_->index(cell_[i]));
  Cell<D> low = cell_[i], high = cell_[i];
  for (int k = 0; k < D; ++k)
    if (k == axis)
      low[k] = high[k] = cell_[i][k] + step;
    else
      --low[k], ++high[k];
  predict_pairs(i, low, high);
  predict_crossing(i, now, pending);
  schedule(i);
}

template <int D>
void EventCore<D>::set_generation(Record<D>& r, const EventKey<D>& key) {
  if (key.generation > std::numeric_limits<std::uint16_t>::max())
    throw Error(Failure::numerical,
                partners(key) + " collide without end at one instant; separate the spheres that touch there");
  r.generation = static_cast<std::uint16_t>(key.generation);
}

template <int D>
void EventCore<D>::collide_pair(const EventKey<D>& key, const Report& report) {
  Record<D>&a = records_[key.lo], &b = records_[key.hi];
  advance(a, key.time);
  advance(b, key.time);
  const Vec<D> shift = box_.shift(key.image);
  const Vec<D> d = a.x - b.x + shift;
  const double mass_a = particles_.mass[key.lo], mass_b = particles_.mass[key.hi];
  const double radii = particles_.radius[key.lo] + particles_.radius[key.hi], sigma = grown(radii, key.time);
  const Vec<D> impulse = collision_factor<D>(d, a.v - b.v, sigma, radii * growth_, mass_a, mass_b) * d;
  a.v += impulse / mass_a;
  b.v -= impulse / mass_b;
  set_generation(a, key);
  set_generation(b, key);
  ++version_[key.lo];
  ++version_[key.hi];
  ++report.counters.sphere_sphere;
  report.counters.collision_virial.add(d.dot(impulse));
  report.counters.max_overlap = std::max(report.counters.max_overlap, 1 - d.norm() / sigma);
  if (report.contacts) report.contacts->push_back({key, a.x, b.x - shift, impulse});
}

template <int D>
void EventCore<D>::collide_wall(const EventKey<D>& key, const Report& report) {
  Record<D>& r = records_[key.lo];
  advance(r, key.time);
  const int axis = static_cast<int>(key.hi / 2);
  const double mass = particles_.mass[key.lo], radius = grown(particles_.radius[key.lo], key.time);
  const double rate = particles_.radius[key.lo] * growth_;
  const double after = (key.hi % 2 == 0 ? 2 * rate : -2 * rate) - r.v[axis];
  if (report.contacts) {
    Contact<D> contact{key, r.x, r.x, Vec<D>::Zero()};
    contact.x_hi[axis] = key.hi % 2 == 0 ? 0.0 : box_.edges[axis];
    contact.impulse[axis] = mass * (after - r.v[axis]);
    report.contacts->push_back(contact);
  }
  const double gap = key.hi % 2 == 0 ? r.x[axis] - radius : box_.edges[axis] - radius - r.x[axis];
  report.counters.max_overlap = std::max(report.counters.max_overlap, -gap / radius);
  r.v[axis] = after;
  set_generation(r, key);
  ++version_[key.lo];
  ++report.counters.sphere_wall;
}

template <int D>
void EventCore<D>::insert(Id i, std::size_t cell) {
  previous_[i] = kNobody;
  next_[i] = first_[cell];
  if (next_[i] != kNobody) previous_[next_[i]] = i;
  first_[cell] = i;
}

template <int D>
void EventCore<D>::remove(Id i) {
  if (previous_[i] != kNobody)
    next_[previous_[i]] = next_[i];
  else
    first_[grid_->index(cell_[i])] = next_[i];
  if (next_[i] != kNobody) previous_[next_[i]] = previous_[i];
}

template class EventCore<2>;
template class EventCore<3>;

}  // namespace carom
