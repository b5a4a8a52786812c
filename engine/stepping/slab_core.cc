// SPDX-License-Identifier: BSD-3-Clause
#include "engine/stepping/slab_core.h"

#include <array>
#include <cmath>

#include "engine/base/error.h"
#include "engine/events/meeting.h"
#include "engine/forces/forces.h"
#include "engine/ranks/shared_contacts.h"
#include "engine/stepping/path_hash.h"

namespace carom {

namespace {
constexpr double kPathMargin = 1.25;         // paths under later accelerations, relative to the first paths
constexpr double kMostBend = 4;              // ½ h² a, in mean distances: a particle then has 10³ candidates
constexpr std::size_t kBetweenLooks = 1024;  // events between two checks for a request to stop
constexpr int kEventsPerTiming = 32;  // of which one is timed: reading the clock costs a few per cent of an event
// Contacts of one particle on parabolas in a slab: a light sphere between two approaching heavy ones collides about
// π √(M/m) times (Galperin, Regul. Chaotic Dyn. 8 (2003) 375), 10³ for masses of 1 : 10⁵. A sweep costs as much as its
// contacts, and a shorter slab takes fewer sweeps, so flights with more contacts than this are not tried.
constexpr std::uint32_t kMostContactsOfParticle = 1000;
}  // namespace

template <int D>
SlabCore<D>::SlabCore(System<D>& system, std::uint64_t max_events)
    : system_(system),
      box_(system.box),
      particles_(system.particles),
      max_events_(max_events),
      most_bend_(kMostBend * mean_distance(system)) {
  system.fields.add_value("reactions", reactions_);
  system.fields.add_working(
      this, [this] { release(); },
      [this] {
        scan_.emplace(system_, max_events_, reactions_);
        slot_.assign(particles_.size(), 0);
      });
}

/// Frees all arrays with an entry for each particle.
template <int D>
void SlabCore<D>::release() {
  scan_.reset();
  const auto free = [](auto&... vectors) { (std::remove_reference_t<decltype(vectors)>().swap(vectors), ...); };
  free(near_, longest_path_of_, largest_bend_, held_, x_, last_x_, v_, moved_, slot_, flights_, sequences_,
       last_sequences_);
}

template <int D>
void SlabCore<D>::begin(Positions<D> v, Positions<D> a, double length, bool resolved) {
  const Stopwatch watch(counters_->seconds.predict);
  start_v_ = v;
  a_ = a;
  length_ = length;
  walls_ = box_.walls();
  has_steps_ = !box_.steps.empty();
  resolved_ = resolved;
  last_sequences_.clear();
  sequences_.clear();
  const std::size_t n = particles_.size();
  for (auto* each : {&largest_bend_, &longest_path_of_}) each->resize(n);
  for (auto* each : {&x_, &last_x_, &v_}) each->resize(n, Vec<D>::Zero());
  moved_.resize(n);
  held_.assign(scan_->resting().empty() ? 0 : n, 0);
  for (const auto& contact : scan_->resting()) {
    held_[contact.key.lo] = 1;
    if (contact.key.kind == EventKind::pair) held_[contact.key.hi] = 1;
  }
  margin_ = own_longest_path_ = 0;
  for (Id i = 0; i < n; ++i) {
    const double straight = length * beside_flow(i, v[i]).norm(), bent = 0.5 * length * length * acceleration(i).norm();
    longest_path_of_[i] = kPathMargin * (straight + bent);
    margin_ = bent <= most_bend_ ? std::max(margin_, longest_path_of_[i]) : kNever;
    if (particles_.owns(i)) own_longest_path_ = std::max(own_longest_path_, longest_path_of_[i]);
    largest_bend_[i] = (kPathMargin - 1) * straight + kPathMargin * bent;
  }
  near_.clear();
  reject_wide_margin();
  if (std::isfinite(margin_)) find_near();
}

/// Makes margin_ infinite, which rejects the flight, under accelerations for which a parabola may be longer than a
/// quarter of a periodic box, so that two particles may approach each other by more than half of it: beyond that each
/// pair has several images within reach.
template <int D>
void SlabCore<D>::reject_wide_margin() {
  for (int k = 0; k < D; ++k)
    if (box_.periodic(k) && !a_.empty() && margin_ > 0.25 * box_.edges[k]) margin_ = kNever;
}

/// Finds the candidate pairs within margin_, and which of them may meet before any other collision.
template <int D>
void SlabCore<D>::find_near() {
  const auto& x = particles_.x;
  const double stretch = this->stretch();
  // The list adds two margins to the contact distance.
  const double wide = box_.sheared() ? (stretch - 1) * *std::ranges::max_element(particles_.radius) : 0;
  pairs_ = scan_->list().cover(x, box_.sheared() ? stretch * margin_ + wide : margin_);
  near_.clear();
  for (std::uint32_t k = 0; k < pairs_.size(); ++k) {
    const auto& [i, j, image] = pairs_[k];
    const PairSteps* const steps = scan_->steps(i, j);
    const double radii = particles_.radius[i] + particles_.radius[j],
                 sigma = steps ? steps->farthest(radii) : scan_->contact_distance(i, j);
    const double touching = sigma + scan_->tolerance(sigma);
    const double near = stretch * (touching + longest_path_of_[i] + longest_path_of_[j]);
    const Vec<D> d = x[i] - x[j] + box_.shift(image);
    if (!(d.squaredNorm() <= near * near)) continue;
    // Each path bends off its straight line by no more than largest_bend_.
    Vec<D> v = start_v_[i] - start_v_[j];
    v[0] += box_.offset(image).slide;
    const double b = d.dot(v), passing = touching + largest_bend_[i] + largest_bend_[j];
    const double closest = b < 0 ? std::min(length_, -b / v.squaredNorm()) : 0.0;
    if ((d + closest * v).squaredNorm() <= passing * passing) near_.push_back(k);
  }
}

template <int D>
FlightEnd<D> SlabCore<D>::fly(Positions<D> a) {
  a_ = a;
  x_.swap(last_x_);
  FlightEnd<D> end;
  do {
    for (const Flight& each : flights_) slot_[each.id] = 0;
    flights_.clear();
    queue_.clear();
    contacts_.clear();
    longest_path_ = std::isfinite(margin_) ? 0 : kNever;
    too_many_contacts_ = left_ = false;
    plain_ends();
    if (longest_path_ == 0) {
      {
        const Stopwatch watch(counters_->seconds.predict);
        predict_first();
      }
      const Stopwatch watch(counters_->seconds.queue);
      end = serve();
    }
    if (!left_ && longest_path_ > 0 && std::isfinite(longest_path_)) {
      margin_ = kPathMargin * longest_path_;
      reject_wide_margin();
      if (std::isfinite(margin_))
        find_near();
      else
        longest_path_ = kNever;
    }
  } while (!left_ && longest_path_ > 0 && std::isfinite(longest_path_));
  for (const Flight& each : flights_) {
    const double time_left = length_ - each.t;
    const Vec<D> a_i = acceleration(each.id);
    x_[each.id] = each.x + time_left * each.v + (0.5 * time_left * time_left) * a_i;
    v_[each.id] = each.v + time_left * a_i;
  }
  const bool divided = !system_.decomposition.knows_all();
  counts_ = {};
  for (Id i = 0; i < x_.size(); ++i) {
    moved_[i] = x_[i] != last_x_[i];
    if (!divided || particles_.owns(i)) counts_[0] += moved_[i];
  }
  for (const Contact<D>& contact : contacts_) {
    counts_[1] += !divided || particles_.owns(contact.key.lo) ? 1 : 0;
    if (contact.key.kind == EventKind::pair) counts_[1] += !divided || particles_.owns(contact.key.hi) ? 1 : 0;
  }
  if (!divided && (system_.decomposition.joined() ? system_.decomposition.any(left_) : left_)) throw SlabLeft{};
  if (divided)
    compare_ranks(!end.complete || too_many_contacts_ || longest_path_ > 0);
  else if (too_many_contacts_)
    throw_too_many_contacts(box_.contacts, max_events_, partners(end.key, box_));
  else if (longest_path_ > 0 && !a_.empty())
    return {.complete = false, .too_strong = true};
  else if (longest_path_ > 0) {
    Id i = 0;
    while (i + 1 < x_.size() && std::isfinite(longest_path_of_[i]) && x_[i].allFinite()) ++i;
    throw Error(Failure::numerical, "the position or velocity of particle " + std::to_string(particles_.id_of(i)) +
                                        " is not finite; use a smaller integrator.step");
  }
  compare_sequences();
  return end;
}

/// Predicts the contacts of particles before their first collision.
template <int D>
void SlabCore<D>::predict_first() {
  for (const std::uint32_t k : near_) predict_pair(pairs_[k].i, pairs_[k].j, pairs_[k].image);
  for (const Id i : beyond_)
    for (const auto& [j, pair] : scan_->list().partners().of(i))
      predict_pair(std::min(i, j), std::max(i, j), pairs_[pair].image);
  for (Id i = 0; i < x_.size(); ++i) predict_walls(i);
  std::make_heap(queue_.begin(), queue_.end());
}

/// Computes where all particles end without contacts, and which of them may leave the range of near_.
template <int D>
void SlabCore<D>::plain_ends() {
  const Stopwatch watch(counters_->seconds.predict);
  beyond_.clear();
  const double h = length_, half = 0.5 * h * h;
  const auto& x = particles_.x;
  if (a_.empty()) {
    for (std::size_t i = 0; i < x.size(); ++i) {
      x_[i] = x[i] + h * start_v_[i];
      v_[i] = start_v_[i];
    }
    return;
  }
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Vec<D> bent = half * a_[i];
    x_[i] = x[i] + h * start_v_[i] + bent;
    v_[i] = start_v_[i] + h * a_[i];
    if (!(bent.squaredNorm() <= largest_bend_[i] * largest_bend_[i])) beyond_.push_back(static_cast<Id>(i));
  }
  for (const Id i : beyond_)
    if (const double far = path(beside_flow(i, start_v_[i]), a_[i], h); !(far <= margin_))
      note_path(half * a_[i].norm() <= most_bend_ ? far : kNever);
}

/// Handles the events of the queue until it is empty or an event ends the flight.
template <int D>
FlightEnd<D> SlabCore<D>::serve() {
  for (std::size_t served = 1; !queue_.empty() && longest_path_ == 0; ++served) {
    if (served % kBetweenLooks == 0 && watch_ && watch_->asked_here()) {
      left_ = true;
      return {.complete = false};
    }
    std::pop_heap(queue_.begin(), queue_.end());
    const Planned event = queue_.back();
    queue_.pop_back();
    const EventKey<D>& key = event.key;
    const bool pair = key.kind == EventKind::pair;
    if (event.version_lo != version(key.lo) || (pair && event.version_hi != version(key.hi))) continue;
    const bool step = has_steps_ && crosses(key);
    // resolve() has handled contacts at the start; what is found again is rounding.
    if (!step && resolved_ && !(key.time > 0)) continue;
    if (!step && !box_.contacts.elastic() && at_the_end(key)) continue;
    const bool held = !held_.empty() && (held_[key.lo] != 0 || (pair && held_[key.hi] != 0));
    // A straight flight presses no spheres together: elastic contacts that do not approach need no impulse.
    if (step && held) {  // the piece ends right after the step
      if (const double after = end_after(key); after < length_) return {.complete = false, .time = after, .key = key};
    } else if (!step && (held || ((!a_.empty() || !box_.contacts.elastic()) && comes_to_rest(key)))) {
      if (falls_back(key)) {  // and with it others, so that the piece need not be tried again for each of them
        for (const Planned& other : queue_) falls_back(other.key);
        return {.complete = false, .key = key};
      }
      return {.complete = false, .time = box_.contacts.elastic() ? key.time : end_before(key, held), .key = key};
    }
    const std::uint32_t most = std::max(version(key.lo), pair ? version(key.hi) : 0);
    const bool too_strong = !a_.empty() && most >= kMostContactsOfParticle;
    too_many_contacts_ = !too_strong && already_ + contacts_.size() >= max_events_;
    if (too_strong || too_many_contacts_)
      return {.complete = false, .too_strong = too_strong, .time = key.time, .key = key};
    if (served % kEventsPerTiming != 0) {
      collide(key);
      predict_both(key);
      continue;
    }
    timed(counters_->seconds.collide, [&] { collide(key); });
    timed(counters_->seconds.predict, [&] { predict_both(key); });
  }
  return {};
}

template <int D>
Vec<D> SlabCore<D>::position(Id i, double t) const {
  const Vec<D> a = acceleration(i);
  if (slot_[i] == 0) return particles_.x[i] + t * start_v_[i] + (0.5 * t * t) * a;
  const Flight& f = flights_[slot_[i] - 1];
  const double s = t - f.t;
  return f.x + s * f.v + (0.5 * s * s) * a;
}

template <int D>
Vec<D> SlabCore<D>::velocity(Id i, double t) const {
  const Vec<D> a = acceleration(i);
  if (slot_[i] == 0) return start_v_[i] + t * a;
  const Flight& f = flights_[slot_[i] - 1];
  return f.v + (t - f.t) * a;
}

/// Books the time of an event in kEventsPerTiming, for all of them.
template <int D>
template <class F>
void SlabCore<D>::timed(double& total, F&& work) {
  double seconds = 0;
  {
    const Stopwatch watch(seconds);
    work();
  }
  total += kEventsPerTiming * seconds;
  counters_->seconds.queue -= (kEventsPerTiming - 1) * seconds;  // that of the others
}

template <int D>
void SlabCore<D>::predict_both(const EventKey<D>& key) {
  predict_all(key.lo);
  if (key.kind == EventKind::pair) predict_all(key.hi);
}

template <int D>
void SlabCore<D>::predict_all(Id i) {
  for (const auto& [j, pair] : scan_->list().partners().of(i))
    predict_pair(std::min(i, j), std::max(i, j), pairs_[pair].image);
  predict_walls(i);
}

/// Predicts the next contact of the present flights, from the later of their starts.
template <int D>
void SlabCore<D>::predict_pair(Id i, Id j, const Image<D>& image) {
  const double t = std::max(start(i), start(j)), sigma = scan_->contact_distance(i, j), time_left = length_ - t;
  const Offset<D> offset = box_.offset(image);
  const Vec<D> d = position(i, t) - position(j, t) + offset.at(t);
  const Vec<D> v_i = velocity(i, t), v_j = velocity(j, t);
  Vec<D> v = v_i - v_j;
  v[0] += offset.slide;
  const PairSteps* const steps = has_steps_ ? scan_->steps(i, j) : nullptr;
  const bool touching = scan_->touches(d, sigma);
  const double slack =
      touching || steps ? sigma * (scan_->rounding_speed(i, v_i) + scan_->rounding_speed(j, v_j)) : 0.0;
  const double s = steps        ? step_time({d, v}, *steps, i, j, time_left, slack)
                   : a_.empty() ? contact_time<D>(d, v, sigma, slack)
                                : contact_time<D>(d, v, a_[i] - a_[j], sigma, time_left, touching, slack);
  if (!(t + s < length_)) return;
  EventKey<D> key{.time = t + s, .kind = EventKind::pair, .lo = i, .hi = j, .image = image};
  if (!held_.empty() && scan_->rests(key) && !(steps && crosses(key))) return;
  key.generation = std::max(generation(i, key.time), generation(j, key.time));
  queue_.push_back({key, version(i), version(j)});
  if (!flights_.empty()) std::push_heap(queue_.begin(), queue_.end());
}

/// The time in which a pair reaches its core or a step.
template <int D>
double SlabCore<D>::step_time(const PairMotion<D>& motion, const PairSteps& steps, Id i, Id j, double time_left,
                              double slack) const {
  const double sigma = particles_.radius[i] + particles_.radius[j];
  const bool just_met = slot_[i] != 0 && slot_[j] != 0 && start(i) == start(j);
  const double tolerance = side_tolerance(just_met, false, sigma, scan_->tolerance(0));
  if (a_.empty()) return next_step_time<D>(steps, motion.d, motion.v, sigma, tolerance, [&] { return slack; });
  return next_step_time<D>(steps, motion, a_[i] - a_[j], sigma, time_left, tolerance, scan_->tolerance(sigma), slack);
}

/// The step at which an event happens; null: it is a contact.
template <int D>
const StepSurface* SlabCore<D>::step_of(const EventKey<D>& key) const {
  const PairSteps* const steps = key.kind == EventKind::pair ? scan_->steps(key.lo, key.hi) : nullptr;
  if (!steps) return nullptr;
  const Vec<D> d = position(key.lo, key.time) - position(key.hi, key.time) + box_.shift(key.image);
  return step_at(*steps, d.norm(), particles_.radius[key.lo] + particles_.radius[key.hi]);
}

/// A time after an event at a step, until which the spheres move by a quarter of the tolerance.
template <int D>
double SlabCore<D>::end_after(const EventKey<D>& key) const {
  const double sigma = particles_.radius[key.lo] + particles_.radius[key.hi];
  const double speed = velocity(key.lo, key.time).norm() + velocity(key.hi, key.time).norm();
  return key.time + 0.25 * scan_->tolerance(sigma) / speed;
}

template <int D>
void SlabCore<D>::predict_walls(Id i) {
  if (walls_.empty() || particles_.fixed(i)) return;
  const double t = start(i), radius = particles_.radius[i];
  const Vec<D> x = position(i, t), v = velocity(i, t), a = acceleration(i);
  for (const Wall<D>& wall : walls_) {
    const double s = wall_meeting<D>(wall, x, v, a, radius, 0, t, length_ - t, scan_->tolerance(radius),
                                     [&] { return scan_->rounding_speed(i, v); });
    if (!(t + s < length_)) continue;
    EventKey<D> key{.time = t + s, .kind = EventKind::wall, .lo = i, .hi = wall.number};
    if (!held_.empty() && scan_->rests(key)) continue;
    key.generation = generation(i, key.time);
    queue_.push_back({key, version(i)});
    if (!flights_.empty()) std::push_heap(queue_.begin(), queue_.end());
  }
}

/// The geometry of a contact of two flights, or of a flight and a wall.
template <int D>
struct SlabCore<D>::Meeting {
  Meeting(const SlabCore& core, const EventKey<D>& key) : v_lo(core.velocity(key.lo, key.time)) {
    if (key.kind == EventKind::wall) {
      const Wall<D> wall = core.box_.wall(key.hi).at(core.position(key.lo, key.time));
      normal = wall.normal;
      speed = wall.opening(v_lo, key.time);
      sigma = core.particles_.radius[key.lo];
      return;
    }
    const Offset<D> offset = core.box_.offset(key.image);
    normal = core.position(key.lo, key.time) - core.position(key.hi, key.time) + offset.at(key.time);
    v_hi = core.velocity(key.hi, key.time);
    v_hi[0] -= offset.slide;
    speed = normal.dot(v_lo - v_hi) / normal.norm();
    sigma = core.scan_->contact_distance(key.lo, key.hi);
    hard.distance = sigma;
    if (core.has_steps_) [[unlikely]]
      hard = core.scan_->rest().surface(key, normal);
    if (!hard.tether()) return;
    normal = -normal;
    speed = -speed;
  }
  double gap() const { return hard.gap(normal.norm()); }  // of a pair
  Vec<D> v_lo, v_hi = v_lo, normal;
  double speed = 0;  // along the normal, negative if the gap closes
  double sigma = 0;
  HardSurface hard;
};

/// Whether the spheres meet too slowly for an impact.
template <int D>
bool SlabCore<D>::comes_to_rest(const EventKey<D>& key) const {
  const Meeting meeting(*this, key);
  return scan_->next(key, meeting.normal, meeting.speed, meeting.v_lo, meeting.v_hi) != Next::hits;
}

/// The time at which the gap is a quarter of the tolerance; that of the contact if this was before the start. If the
/// approach is slow, one of the spheres is `held`, and the method does not kick: the time at which the gap is half of
/// the one from which the approach stops, so that the end need not be found to rounding.
template <int D>
double SlabCore<D>::end_before(const EventKey<D>& key, bool held) const {
  const Meeting meeting(*this, key);
  if (!(meeting.speed < 0)) return key.time;
  const double both_fly_from = std::max(start(key.lo), key.kind == EventKind::pair ? start(key.hi) : 0.0);
  const double closed = 0.25 * scan_->tolerance(meeting.sigma);
  const bool slow = held && !scan_->rest().kicks() && comes_to_rest(key);
  const double wide = slow ? 0.5 * scan_->rest().widest_gap(key, meeting.normal) : 0;
  for (const double early : {std::max(closed, wide), closed})
    if (const double end = key.time + early / meeting.speed; end > both_fly_from) return end;
  return key.time;
}

/// Whether a contact is so close to the end of the slab, or so slow, that without it the spheres would never overlap by
/// more than a quarter of the tolerance: it belongs to the next slab. Spheres that graze each other may be apart again
/// at the end, so the depth is also bounded from the contact on: the gap closes no faster than speed and acceleration
/// there make it.
template <int D>
bool SlabCore<D>::at_the_end(const EventKey<D>& key) const {
  const bool pair = key.kind == EventKind::pair;
  const Meeting meeting(*this, key);
  const double most = 0.25 * scan_->tolerance(meeting.sigma), time_left = length_ - key.time;
  const Vec<D> a = acceleration(key.lo);
  double gap_acceleration = 0;
  if (pair) {
    gap_acceleration = meeting.normal.dot(a - acceleration(key.hi)) / meeting.normal.norm();
    if (meeting.hard.tether()) gap_acceleration -= (meeting.v_lo - meeting.v_hi).squaredNorm() / meeting.normal.norm();
  } else {
    const Wall<D> wall = box_.wall(key.hi);
    const Vec<D> x = position(key.lo, key.time);
    gap_acceleration = wall.at(x).speeding(a) + wall.curvature(x) * wall.across(meeting.v_lo).squaredNorm();
  }
  if (time_left * (0.5 * time_left * std::max(0.0, -gap_acceleration) - meeting.speed) > most) return false;
  EventKey<D> at_end = key;
  at_end.time = length_;
  if (pair) return Meeting(*this, at_end).gap() >= -most;
  const Wall<D> wall = box_.wall(key.hi);
  const Vec<D> x = position(key.lo, length_);
  return (wall.one_way ? wall.clearance(x, meeting.sigma, length_) : wall.gap(x, meeting.sigma, length_)) >= -most;
}

/// Whether the spheres touch at the start, or are as near as a slow approach may stop, and come together again so
/// slowly that the contact rests, which the accelerations before this flight did not show. True once for each contact
/// in a step.
template <int D>
bool SlabCore<D>::falls_back(const EventKey<D>& key) {
  const bool pair = key.kind == EventKind::pair;
  if (!resolved_ || version(key.lo) > 0 || (pair && version(key.hi) > 0)) return false;
  EventKey<D> at_start = key;
  at_start.time = 0;
  const Meeting meeting(*this, key), before(*this, at_start);
  const double gap = pair ? before.gap() : box_.wall(key.hi).gap(particles_.x[key.lo], before.sigma);
  const bool open = gap > scan_->tolerance(before.sigma);
  if (open ? gap > scan_->rest().widest_gap(key, before.normal) : !(before.speed > 0)) return false;
  return scan_->rest().falls_back(key, before.normal, (before.speed - meeting.speed) / key.time, before.speed);
}

/// Starts a new flight of particle i at this event, before the impulse.
template <int D>
typename SlabCore<D>::Flight& SlabCore<D>::flight(Id i, const EventKey<D>& key) {
  const Vec<D> x = position(i, key.time), v = velocity(i, key.time);
  if (slot_[i] == 0) {
    flights_.push_back(
        {x, v, key.time, i, 0, 0, 0, box_.contacts.need_internal() ? particles_.internal(i) : Internal<D>{}});
    slot_[i] = static_cast<std::uint32_t>(flights_.size());
  }
  Flight& f = flights_[slot_[i] - 1];
  f.x = x;
  f.v = v;
  f.t = key.time;
  f.generation = key.generation;
  ++f.version;
  EventKey<D> partners = key;
  partners.time = 0;
  partners.generation = 0;
  add_to_hash(f.hash, partners, particles_);
  return f;
}

/// Applies the impulse if the spheres still approach.
template <int D>
void SlabCore<D>::collide(const EventKey<D>& key) {
  flight(key.lo, key);
  if (key.kind == EventKind::pair) flight(key.hi, key);  // flights_ may have moved
  Flight& lo = flights_[slot_[key.lo] - 1];
  Contact<D> contact{key, lo.x, lo.x, Vec<D>::Zero()};
  const auto partner = [&](Flight& f) {
    return Partner<D>{particles_.mass[f.id], particles_.radius[f.id], particles_.species[f.id],
                      box_.contacts.need_internal() ? &f.internal : nullptr};
  };
  const auto checks_path = [&](const Flight& f) {
    if (const double far = farthest(f); !(far <= margin_)) note_path(far);
  };
  if (key.kind == EventKind::wall) {
    const Wall<D> wall = box_.wall(key.hi).at(lo.x);
    if (!(wall.opening(lo.v, key.time) < 0) && !wall.thermal()) return;
    // Sweeps change the time of a contact, not its random numbers.
    const Draw draw{.id = particles_.id_of(key.lo), .time = box_.time, .number = std::uint64_t{lo.version} << 32};
    const auto [after, impulse, exchange] = wall_impulse<D>(box_.contacts, wall, lo.v, partner(lo), draw, key.time);
    contact.impulse = impulse;
    contact.exchange = exchange;
    lo.v = after;
    contact.x_hi = wall.foot(lo.x, key.time);
  } else {
    Flight& hi = flights_[slot_[key.hi] - 1];
    const Offset<D> offset = box_.offset(key.image);
    const Vec<D> shift = offset.at(key.time), d = lo.x - hi.x + shift;
    Vec<D> v = lo.v - hi.v;
    v[0] += offset.slide;
    contact.x_hi = hi.x - shift;
    const StepSurface* const step = has_steps_ ? step_of(key) : nullptr;
    if (step ? step->tether() && !(d.dot(v) > 0) : !(d.dot(v) < 0)) return;
    const double m_lo = particles_.mass[key.lo], m_hi = particles_.mass[key.hi];
    const auto impulse = step ? step_impulse<D>(*step, box_.contacts, d, v, partner(lo), partner(hi))
                              : pair_impulse<D>(box_.contacts, d, v, partner(lo), partner(hi));
    impulse.apply(d, m_lo, lo.v, m_hi, hi.v);
    contact.impulse = impulse.on_first(d);
    contact.exchange = {.virial = (contact.x_lo - contact.x_hi).dot(impulse.factor * d),
                        .dissipated = impulse.dissipated,
                        .stored = impulse.stored,
                        .shear = -offset.slide * contact.impulse[0],
                        .event = impulse.event};
    contact.v_hi = hi.v;
    contact.v_hi[0] -= box_.flow(hi.x);
    checks_path(hi);
  }
  contact.v_lo = lo.v;
  contact.v_lo[0] -= box_.flow(lo.x);
  checks_path(lo);
  contacts_.push_back(contact);
}

template <int D>
void SlabCore<D>::compare_sequences() {
  last_sequences_.swap(sequences_);
  sequences_.clear();
  for (const Flight& each : flights_) sequences_.push_back({each.id, each.hash});
  std::ranges::sort(sequences_);
  std::vector<Sequence> differ;
  std::ranges::set_symmetric_difference(sequences_, last_sequences_, std::back_inserter(differ));
  swapped_.clear();
  for (const Sequence& each : differ)
    if (swapped_.empty() || swapped_.back() != each.id) swapped_.push_back(each.id);
}

/// Ghosts get the end points that their owners computed. Throws on all ranks: SlabLeft if one of them was asked to
/// stop; HaloTooSmall if a flight failed on one of them, if a ghost that matters had other events than on its owner, or
/// if a path was longer than the halo allows. Collective.
template <int D>
void SlabCore<D>::compare_ranks(bool failed) {
  Decomposition<D>& decomposition = system_.decomposition;
  PathHashes<D> events(particles_);
  for (const Contact<D>& contact : contacts_) events.add(contact.key);
  std::vector<std::uint64_t> at_owners = events.words();
  decomposition.copy_to_ghosts(std::span(at_owners), std::span(x_));
  bool equal = true;
  for (Id i = 0; i < at_owners.size(); ++i) {
    if (particles_.owns(i)) continue;
    moved_[i] = x_[i] != last_x_[i];
    if (at_owners[i] != events.words()[i] && decomposition.matters(i)) equal = false;
  }
  std::array<double, 4> most = {failed ? 1.0 : 0.0, equal ? 0.0 : 1.0, own_longest_path_, left_ ? 1.0 : 0.0};
  auto& [any_failed, any_wrong, farthest, any_left] = most;
  for (const Id i : beyond_)
    if (particles_.owns(i)) farthest = std::max(farthest, path(start_v_[i], a_[i], length_));
  for (const Flight& f : flights_)
    if (particles_.owns(f.id)) farthest = std::max(farthest, this->farthest(f));
  decomposition.ranks().combine(most, counts_);
  if (any_left > 0) throw SlabLeft{};
  if (any_failed > 0) throw HaloTooSmall{};
  if (any_wrong > 0) decomposition.need_deeper_halo();
  decomposition.need_paths(farthest);
}

template <int D>
void SlabCore<D>::commit(double time) {
  if (system_.decomposition.knows_all())
    scan_->commit(time, contacts_);
  else if (!commit_contacts<D>(system_, contacts_, max_events_, *counters_, log_))
    throw HaloTooSmall{};  // the step is repeated with all particles on each rank, and then the error names them
}

template class SlabCore<2>;
template class SlabCore<3>;

}  // namespace carom
