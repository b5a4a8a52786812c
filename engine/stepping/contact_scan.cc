// SPDX-License-Identifier: BSD-3-Clause
#include "engine/stepping/contact_scan.h"

#include <algorithm>
#include <array>
#include <string>

#include "engine/base/error.h"
#include "engine/events/meeting.h"

namespace carom {

namespace {

// Generations of impulses at one instant: an impact on a row of n spheres takes n generations, a light sphere between
// two heavy ones π √(M/m), which is 3000 for masses of 1 : 10⁶ (Galperin, Regul. Chaotic Dyn. 8 (2003) 375).
constexpr std::uint32_t kMostGenerations = 30000;
// A round changes the bounds by |u| h/σ of what the round before changed, the angle by which a pair turns in the piece;
// after eight rounds with angles of 0.01 that is the rounding.
constexpr int kRoundsOfBraking = 8;
constexpr double kMostCorrection = 1e-6 / kRounding;  // of an overlap, relative to the rounding of the speeds

}  // namespace

template <int D>
ContactScan<D>::ContactScan(const System<D>& system, std::uint64_t max_events, std::vector<Reaction<D>>& reactions)
    : box_(system.box),
      particles_(system.particles),
      walls_(system.box.walls()),
      walls_at_(system.box.time),
      tolerance_(system.box.gap_tolerance()),
      list_(system.box, system.box.steps.reach()(system.particles.radius), {}, system.particles.all_fixed()),
      keeps_momentum_(system.keeps_momentum()),
      max_events_(max_events),
      reactions_(reactions),
      rest_(system.box, system.particles, reactions) {}

template <int D>
void ContactScan<D>::begin_step(Counters& counters, std::vector<Contact<D>>* contacts, const std::vector<Vec<D>>* a,
                                double length, SlabWatch* watch, std::uint64_t already) {
  counters_ = &counters;
  contacts_ = contacts;
  watch_ = watch;
  walls_at_ = std::numeric_limits<double>::quiet_NaN();  // they may move otherwise from now on
  events_ = already;
  events_at_last_cut_ = std::numeric_limits<std::uint64_t>::max();
  solver_.forget();  // bits must not depend on where a run was interrupted
  rest_.begin_step(a, length);
}

/// Finds all contacts at x, in the order of their keys, and gaps so small that contacts may be held there.
template <int D>
void ContactScan<D>::find_touching(double time, Positions<D> x) {
  touching_.clear();
  widest_ = rest_.widest_gap();
  const auto note = [&](const EventKey<D>& key, const Vec<D>& normal, double gap, double sigma, double speed = 0) {
    counters_->note_overlap(-gap / sigma, [&] {
      const Id lo = particles_.id_of(key.lo);
      const bool pair = key.kind == EventKind::pair;
      return Overlap(
          -gap / sigma, sigma,
          pair ? pair_key<D>(time, 0, lo, particles_.id_of(key.hi), {}) : EventKey<D>{time, 0, key.kind, lo, key.hi});
    });
    touching_.push_back({.key = key, .normal = normal, .speed = speed, .gap = gap});
  };
  EventKey<D> key;
  key.time = time;
  const auto name = [&](const NeighbourPair<D>& pair) { key.lo = pair.i, key.hi = pair.j, key.image = pair.image; };
  const bool has_steps = !box_.steps.empty();
  for (const auto& pair : list_.cover(x, 0.5 * widest_)) {
    const Vec<D> d = x[pair.i] - x[pair.j] + box_.shift(pair.image);
    const double sigma = contact_distance(pair.i, pair.j), most = sigma + std::max(tolerance(sigma), widest_);
    if (has_steps) [[unlikely]]
      if (const HardSurface hard = hard_surface(box_, particles_, pair.i, pair.j, d.norm()); hard.tether()) {
        name(pair);
        const double gap = hard.gap(d.norm());
        if (gap > noticed_gap(key, -d)) continue;
        note(key, -d, gap, sigma);
        touching_.back().tether = true;
        continue;
      }
    if (d.squaredNorm() > most * most) continue;
    name(pair);
    if (widest_ > 0 && d.norm() - sigma > noticed_gap(key, d)) continue;
    note(key, d, d.norm() - sigma, sigma);
  }
  key.kind = EventKind::wall;
  key.image = {};
  for (Id i = 0; i < x.size(); ++i) {
    if (particles_.fixed(i)) continue;
    for (const Wall<D>& wall : walls()) {
      const double gap = wall.gap(x[i], particles_.radius[i]);
      if (gap > std::max(tolerance(particles_.radius[i]), widest_)) continue;
      key.lo = i;
      key.hi = wall.number;
      const Vec<D> normal = wall.at(x[i]).normal;
      if (widest_ > 0 && gap > noticed_gap(key, normal)) continue;
      note(key, normal, gap, particles_.radius[i], wall.velocity);
    }
  }
  std::ranges::sort(touching_, {}, &Touch<D>::key);
  auto known = reactions_.begin();  // in the order of keys too, so each touch finds its reaction from there on
  for (Touch<D>& touch : touching_) {
    const EventKey<D> partners = without_time(touch.key);
    while (known != reactions_.end() && known->key < partners) ++known;
    touch.force = known != reactions_.end() && known->key == partners ? known->force : 0.0;
  }
  if (widest_ > 0) note_open();
}

/// Decides what may happen to contacts with a small gap.
template <int D>
void ContactScan<D>::note_open() {
  std::vector<char> touched(particles_.size(), 0);
  for (const Touch<D>& touch : touching_)
    if (!open(touch)) touched[touch.key.lo] = touched[touch.pair() ? touch.key.hi : touch.key.lo] = 1;
  for (Touch<D>& touch : touching_) {
    if (!open(touch)) continue;
    touch.may_hit = touched[touch.key.lo] || (touch.pair() && touched[touch.key.hi]);
  }
}

/// Sorts the contacts into approaching and resting ones. `all_stop`: contacts that dissipate rest if they approach.
template <int D>
void ContactScan<D>::sort_out(Positions<D> v, bool all_stop) {
  approaching_.clear();
  resting_.clear();
  for (const Touch<D>& touch : touching_) {
    const Next its = next(touch, v);
    if (its == Next::parts || (its == Next::hits && !touch.may_hit)) continue;
    if (its == Next::hits && !(all_stop && rest_.dissipates(touch.key)))
      approaching_.push_back(touch);
    else
      resting_.push_back({.key = without_time(touch.key), .normal = touch.normal, .force = touch.force});
  }
}

template <int D>
double ContactScan<D>::normal_speed(const Touch<D>& touch, Positions<D> v) const {
  if (!touch.pair()) return touch.normal.dot(v[touch.key.lo]) - touch.speed;
  return touch.normal.dot(v[touch.key.lo] - v[touch.key.hi]) / touch.normal.norm();
}

template <int D>
void ContactScan<D>::count_event(const EventKey<D>& key) {
  if (++events_ > max_events_) throw_too_many_contacts(box_.contacts, max_events_, partners(key, box_));
}

template <int D>
void ContactScan<D>::commit(double time, std::span<const Contact<D>> executed) {
  for (Contact<D> contact : executed) {
    count_event(contact.key);
    contact.key.time += time;
    counters_->record(contact, contacts_);
  }
}

template <int D>
double ContactScan<D>::resolve(double time, Positions<D> x, Vectors<D> v, const ApplyImpulse<D>& impulse) {
  find_touching(time, x);
  sort_out(v);
  double lost = 0;
  for (std::uint32_t generation = 0;; ++generation) {
    one_by_one(generation, x, v, impulse);
    // Inelastic impacts in a cluster go on without end, ever slower; after some generations the rest of the approach
    // stops.
    const bool all_stop = generation >= kMostBounces;
    sort_out(v, all_stop);
    if (!approaching_.empty()) continue;
    if (resting_.empty()) return lost;
    if (watch_) watch_->before_change();
    const bool dissipative = !box_.contacts.elastic();
    const std::vector<Vec<D>> before(dissipative ? v.begin() : v.end(), v.end());  // empty unless contacts dissipate
    lost += stop_rounding(v);
    if (dissipative) {  // a sphere that stops may approach another one that it was leaving
      std::vector<RestingContact<D>> all;
      for (const Touch<D>& touch : touching_)
        if (rest_.dissipates(touch.key) || rests(touch.key))
          all.push_back({.key = without_time(touch.key), .normal = touch.normal, .force = touch.force});
      resting_.swap(all);
    }
    lost += stop_approach(x, v);
    if (dissipative) lost -= count_dissipated(before, v);
    sort_out(v, all_stop);  // a sphere that was stopped may have been moving away from another contact
    // Another generation follows while a contact approaches faster than a resting one may, but not without end.
    const auto still_approaches = [&](const Touch<D>& touch) {
      const Next its = next(touch, v);
      return its == Next::stops || (its == Next::hits && touch.may_hit);
    };
    if (approaching_.empty() &&
        !(dissipative && generation < 2 * kMostBounces && std::ranges::any_of(touching_, still_approaches)))
      break;
    if (!approaching_.empty()) count_event(approaching_.front().key);
  }
  return lost;
}

/// One generation of impulses, in key order.
template <int D>
void ContactScan<D>::one_by_one(std::uint32_t generation, Positions<D> x, Vectors<D> v,
                                const ApplyImpulse<D>& impulse) {
  for (Touch<D>& touch : approaching_) {
    // An earlier impulse of this generation may have separated the spheres.
    if (next(touch, v) != Next::hits) continue;
    touch.key.generation = generation;
    if (generation > kMostGenerations)
      throw Error(Failure::numerical, partners(touch.key, box_) +
                                          " and their neighbours collide without end at one instant: they touch on all "
                                          "sides and have no room to part; leave gaps between spheres that fill the "
                                          "space between walls, or a periodic box");
    count_event(touch.key);
    if (watch_) watch_->before_change();
    const bool fixed = particles_.fixed(touch.key.lo);
    const Id moves = fixed ? touch.key.hi : touch.key.lo;
    const Vec<D> before = v[moves];
    const double dissipated = impulse(touch), mass = particles_.mass[moves];
    const double gained = 0.5 * mass * (v[moves].squaredNorm() - before.squaredNorm());
    record(touch, x, v, (fixed ? -mass : mass) * (v[moves] - before), dissipated, gained);
  }
}

template <int D>
void ContactScan<D>::record(const Touch<D>& touch, Positions<D> x, Positions<D> v, const Vec<D>& impulse,
                            double dissipated, double gained) {
  const Id lo = touch.key.lo, hi = touch.key.hi;
  Contact<D> contact{touch.key, x[lo], x[lo], impulse};
  contact.v_lo = v[lo];
  if (touch.pair()) {
    contact.v_hi = v[hi];
    contact.exchange.virial = touch.tether ? -touch.normal.dot(impulse) : touch.normal.dot(impulse);
    if (touch.tether) contact.exchange.event = PairEvent::bounce;
    contact.x_hi = x[hi] - box_.shift(touch.key.image);
  } else {
    const Wall<D> wall = box_.wall(hi);
    contact.x_hi = wall.foot(x[lo]);
    contact.exchange.impulse = wall.at(x[lo]).along_normal(impulse);
    contact.exchange.work = wall.work(impulse);
    if (wall.thermal()) contact.exchange.heat = gained - contact.exchange.work;
  }
  contact.exchange.dissipated = dissipated;
  counters_->record(contact, contacts_);
}

/// Stops spheres with speeds at the rounding level of the forces on them; over many steps these would add up. Where
/// momentum is conserved they are left alone. Returns the energy that the spheres lose.
template <int D>
double ContactScan<D>::stop_rounding(Vectors<D> v) const {
  double lost = 0;
  if (keeps_momentum_) return lost;
  for (const auto& contact : resting_)
    for (const Id i : {contact.key.lo, contact.key.hi}) {
      if (i != contact.key.lo && contact.key.kind != EventKind::pair) continue;
      if (v[i].norm() > rounding_speed(i, Vec<D>::Zero())) continue;
      lost += 0.5 * moving_mass(particles_.mass[i]) * v[i].squaredNorm();
      v[i].setZero();
    }
  return lost;
}

template <int D>
bool ContactScan<D>::rests(const EventKey<D>& key) const {
  return std::ranges::binary_search(resting_, without_time(key), {}, &RestingContact<D>::key);
}

/// How fast a resting contact may approach before it is solved again, times the length of its normal.
template <int D>
double ContactScan<D>::normal_slack(const RestingContact<D>& contact, Positions<D> v) const {
  constexpr double kFractionOfRounding = 1.0 / 16;  // so that contacts stay well within what counts as rounding
  return kFractionOfRounding * rounding_speed(contact.key, v) * contact.normal.norm();
}

/// Finds the reactions, starting from the last ones. `force`: the force for which lambda is 1 if the normal has
/// length 1.
template <int D>
bool ContactScan<D>::press_apart(Vectors<D> w, double force) {
  for (auto& contact : resting_) contact.lambda = contact.force / (force * contact.normal.norm());
  const bool found = solver_.solve(resting_, particles_.mass, w);
  for (auto& contact : resting_) contact.force = contact.lambda * force * contact.normal.norm();
  return found;
}

template <int D>
void ContactScan<D>::hold(Positions<D> v, Vectors<D> a, double time_left) {
  // d·d − σ² = s² ((u² + d·a) + (u·a) s + ¼ a² s²) must not be negative up to `time_left`. For a pair that turns (u)
  // while it slows down (u·a < 0) the second term would cause an overlap. The reaction of a pair, normal to u, does not
  // change its u·a, but those of its neighbours do: the problem is solved again until each bound suits the reactions.
  const std::vector<Vec<D>> by_forces(a.begin(), a.end());
  for (int round = 0; round < kRoundsOfBraking; ++round) {
    bool suits = true;
    for (auto& contact : resting_) {
      contact.slack = 0;
      const double bound = least_opening(contact, v, a, time_left);
      if (round > 0) {
        const Vec<D> between =
            contact.key.kind == EventKind::pair ? Vec<D>(a[contact.key.lo] - a[contact.key.hi]) : a[contact.key.lo];
        suits = suits && contact.normal.dot(between) >= bound - kRounding * std::abs(bound);
      }
      contact.bound = round == 0 ? bound : std::max(bound, contact.bound);
    }
    if (round > 0 && suits) break;
    std::ranges::copy(by_forces, a.begin());
    press_apart(a, 1);
  }
  std::erase_if(resting_,
                [](const auto& contact) { return contact.lambda == 0; });  // these separate, and may meet again
}

/// The least acceleration, times the length of the normal, at which the spheres of a resting contact do not overlap
/// within `time_left` under the accelerations a. A contact that opens, no faster than its holding speed, closes again.
template <int D>
double ContactScan<D>::least_opening(const RestingContact<D>& contact, Positions<D> v, Positions<D> a,
                                     double time_left) const {
  const EventKey<D>& key = contact.key;
  const auto closing = [&](double opening) { return time_left > 0 ? -2 * std::max(0.0, opening) / time_left : 0; };
  if (key.kind != EventKind::pair) {
    const Wall<D> wall = box_.wall(key.hi);
    double bend = 0;
    if (wall.round > 0) {  // the terms of a pair; inside, their signs are reversed, and the term in a² presses too
      const Vec<D> u = wall.across(v[key.lo]), b = wall.across(a[key.lo]);
      const double turn = (wall.inside ? 1 : -1) * u.dot(b) * time_left;
      bend = std::max(0.0, turn) +
             (wall.inside ? u.squaredNorm() + 0.25 * b.squaredNorm() * time_left * time_left : -u.squaredNorm());
      bend /= wall.reach(particles_.radius[key.lo]);
    }
    return wall.acceleration + bend + closing(contact.normal.dot(v[key.lo]) - wall.velocity_at(0));
  }
  const Vec<D> u = v[key.lo] - v[key.hi];
  return std::max(0.0, -u.dot(a[key.lo] - a[key.hi])) * time_left - u.squaredNorm() + closing(contact.normal.dot(u));
}

template <int D>
bool ContactScan<D>::hold_means(Positions<D> x, Positions<D> w_before, Vectors<D> w, double length) {
  for (auto& contact : resting_) {
    const Id lo = contact.key.lo, hi = contact.key.hi;
    const bool pair = contact.key.kind == EventKind::pair;
    contact.normal = normal(contact.key, x);
    const double sigma = pair ? contact_distance(lo, hi) : particles_.radius[lo];
    const HardSurface hard = pair ? rest_.surface(contact.key, contact.normal) : HardSurface{};
    const double gap = pair ? hard.gap(contact.normal.norm()) : box_.wall(hi).gap(x[lo], sigma);
    if (pair) contact.normal = 2 * contact.normal + hard.side * length * (w_before[lo] - w_before[hi]);
    if (!pair)
      if (const Wall<D> wall = box_.wall(hi); wall.round > 0)
        contact.normal += 0.5 * length * wall.curvature(x[lo]) * wall.across(w_before[lo]);
    if (length < 0) contact.normal = -contact.normal;
    contact.bound = pair ? 0.0 : length < 0 ? -mean_speed(hi, length) : mean_speed(hi, length);
    contact.slack = 0.125 * normal_slack(contact, w_before);  // about 30 ε of the speeds, as good as a new solution
    const double touching = tolerance(sigma);
    if (std::abs(gap) <= 0.5 * touching || (gap > 0 && rest_.dissipates(contact.key))) continue;
    // The rounding of many pieces has opened or closed the contact. It is corrected at a speed that counts as rest. In
    // short pieces the rounding of positions, ε x, would undo this; so from an overlap beyond the tolerance the contact
    // returns by a few ε x at once, unless the piece is so short that this takes more than 10⁻⁶ of the speeds: the work
    // of the reaction, 2 m/h times that speed, is known to ε x only.
    const double rounding = rounding_speed(contact.key, w_before), at_once = tolerance(0) / std::abs(length);
    const double speed = gap < -touching && at_once <= kMostCorrection * rounding ? at_once : 0.5 * rounding;
    contact.bound += std::clamp(-gap / std::abs(length), -speed, speed) * contact.normal.norm();
  }
  return press_apart(w, 2 / std::abs(length));
}

/// Where methods kick, spheres fly straight, and a pair that turns on its tether, or a sphere that turns in a round
/// wall, would be beyond it after the step: the rate at which it must come closer, times the length of the normal.
template <int D>
double ContactScan<D>::least_pull(const RestingContact<D>& contact, Positions<D> x, Positions<D> v) const {
  Vec<D> d, u;
  double distance;
  if (contact.key.kind == EventKind::pair) {
    const HardSurface hard = rest_.surface(contact.key, contact.normal);
    if (!hard.tether()) return 0;
    d = -contact.normal;
    u = v[contact.key.lo] - v[contact.key.hi];
    distance = hard.distance;
  } else {
    const Wall<D> wall = box_.wall(contact.key.hi);
    if (!(wall.round > 0 && wall.inside)) return 0;
    d = wall.from_centre(x[contact.key.lo]);
    u = wall.across(v[contact.key.lo]);
    distance = wall.reach(particles_.radius[contact.key.lo]);
  }
  const double at = d.norm(), along = d.dot(u) / at, time = rest_.kick();
  const double across = time * time * std::max(0.0, u.squaredNorm() - along * along);
  const double end = std::sqrt(std::max(0.0, distance * distance - across));
  return contact.normal.norm() * std::max(0.0, at - end) / time;
}

template <int D>
double ContactScan<D>::stop_approach(Positions<D> x, Vectors<D> v, double kick) {
  for (auto& contact : resting_) {
    contact.normal = normal(contact.key, x);
    contact.lambda = contact.force * kick / contact.normal.norm();
    contact.slack = normal_slack(contact, v);
  }
  // The pulls of other tethers turn a pair faster: the problem is solved again until each bound suits the velocities.
  const bool pulls = rest_.kicks() && (!box_.steps.empty() || !box_.options.empty());
  const std::vector<Vec<D>> before(pulls ? v.begin() : v.end(), v.end());
  double lost = 0;
  for (int round = 0; round < (pulls ? kRoundsOfBraking : 1); ++round) {
    bool suits = round > 0;
    for (auto& contact : resting_) {
      const bool wall = contact.key.kind == EventKind::wall;
      const double pull = pulls ? least_pull(contact, x, v) : 0, bound = wall_speed(contact.key) + pull;
      const Vec<D> u = wall ? v[contact.key.lo] : Vec<D>(v[contact.key.lo] - v[contact.key.hi]);
      if (round > 0 && pull > 0) suits = suits && contact.normal.dot(u) >= pull * (1 - kRounding);
      contact.bound = round == 0 ? bound : std::max(bound, contact.bound);
    }
    if (suits) break;
    std::ranges::copy(before, v.begin());
    lost = 0;
    solve_reactions<D>(resting_, particles_.mass, v, &lost);
  }
  for (auto& contact : resting_) {
    lost += count_push(contact, contact.lambda * contact.normal.norm(), wall_speed(contact.key));
    if (kick > 0) contact.force = contact.lambda * contact.normal.norm() / kick;
  }
  return lost;
}

/// Counts the impulse of a wall that holds a sphere while it moves at this speed; returns the work, 0 for a pair.
template <int D>
double ContactScan<D>::count_push(const RestingContact<D>& contact, double impulse, double speed) {
  if (contact.key.kind == EventKind::pair || impulse == 0) return 0;
  WallTally& wall = counters_->wall(contact.key.hi);
  wall.impulse.add(impulse);
  if (speed == 0) return 0;
  wall.work.add(impulse * speed);
  counters_->work.add(impulse * speed);
  return impulse * speed;
}

template <int D>
void ContactScan<D>::drop_open(Positions<D> x) {
  std::erase_if(resting_, [&](const auto& contact) {
    const auto& [key, x_lo] = std::pair(contact.key, x[contact.key.lo]);
    const Vec<D> along = normal(key, x);
    const double gap = key.kind == EventKind::pair ? rest_.surface(key, along).gap(along.norm())
                                                   : box_.wall(key.hi).gap(x_lo, rest_.distance(key));
    return gap > noticed_gap(key, along);
  });
}

/// Counts what stop_approach() has taken from the contacts that dissipate, and returns it. The reaction λ along n takes
/// −λ (u + u′)/2, where u and u′ are the rates n·(v_lo − v_hi) before and after, relative to the wall.
template <int D>
double ContactScan<D>::count_dissipated(Positions<D> before, Positions<D> after) {
  double all = 0;
  for (const auto& contact : resting_) {
    if (contact.lambda == 0 || !rest_.dissipates(contact.key)) continue;
    Vec<D> both = before[contact.key.lo] + after[contact.key.lo];
    if (contact.key.kind == EventKind::pair) both -= before[contact.key.hi] + after[contact.key.hi];
    all += contact.lambda * (wall_speed(contact.key) - 0.5 * contact.normal.dot(both));
  }
  if (all != 0) counters_->dissipated.add(all);
  return all;
}

template <int D>
void ContactScan<D>::remember(double length) {
  if (resting_.empty() && reactions_.empty()) return;
  for (const auto& contact : resting_)
    if (contact.key.kind == EventKind::wall)
      count_push(contact, contact.force * length, mean_speed(contact.key.hi, length));
  reactions_.clear();
  for (const auto& contact : resting_)
    if (contact.force > 0) reactions_.push_back({contact.key, contact.force});
  rest_.note_reactions();
}

template <int D>
double ContactScan<D>::slide(Positions<D> x, Vectors<D> v, double later, const std::function<bool(Id)>& hit) {
  std::vector<RestingContact<D>> held;
  for (const auto& contact : resting_)
    if (contact.force > 0 && !was_hit(contact.key, hit))
      held.push_back({.key = contact.key, .normal = normal(contact.key, x)});
  for (auto& contact : held) {
    contact.slack = normal_slack(contact, v);
    contact.bound = wall_speed(contact.key, later);
  }
  return keep_tangential<D>(held, particles_.mass, v);
}

template <int D>
bool ContactScan<D>::held_slowly(Positions<D> x, Positions<D> v, double later,
                                 const std::function<bool(Id)>& hit) const {
  return std::ranges::all_of(resting_, [&](const RestingContact<D>& contact) {
    if (contact.force == 0 || was_hit(contact.key, hit)) return true;
    const EventKey<D>& key = contact.key;
    const Touch<D> touch{.key = key, .normal = normal(key, x), .speed = wall_speed(key, later)};
    return std::abs(normal_speed(touch, v)) <= std::max(rounding_speed(key, v), rest_.rest_speed(key, touch.normal));
  });
}

template <int D>
Touch<D> ContactScan<D>::earliest(Positions<D> x, Positions<D> v, Positions<D> a, double time_left) {
  const Stopwatch watch(counters_->seconds.predict);
  Touch<D> first;
  first.key.time = kNever;
  double fastest = 0, strongest = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    fastest = std::max(fastest, v[i].squaredNorm());
    strongest = std::max(strongest, a[i].squaredNorm());
  }
  const double path = time_left * (std::sqrt(fastest) + 0.5 * time_left * std::sqrt(strongest));
  EventKey<D> key;
  auto offer = [&](const Vec<D>& normal) {
    // Only resting contacts are left at time 0; hold() has handled those under pressure.
    if (key.time > 0 && key < first.key) first = {key, normal};
  };
  for (const auto& pair : list_.cover(x, path)) {
    const Vec<D> d = x[pair.i] - x[pair.j] + box_.shift(pair.image);
    const double sigma = contact_distance(pair.i, pair.j);
    key.lo = pair.i;
    key.hi = pair.j;
    key.image = pair.image;
    const bool touching = touches(d, sigma);
    key.time = contact_time<D>(d, v[pair.i] - v[pair.j], a[pair.i] - a[pair.j], sigma, time_left, touching,
                               touching ? sigma * rounding_speed(key, v) : 0.0);
    if (key.time < kNever) offer(d);
  }
  key.kind = EventKind::wall;
  key.image = {};
  for (Id i = 0; i < x.size(); ++i) {
    if (particles_.fixed(i)) continue;
    for (const Wall<D>& wall : walls()) {
      const double radius = particles_.radius[i];
      key.lo = i;
      key.hi = wall.number;
      key.time = wall_meeting<D>(wall, x[i], v[i], a[i], radius, 0, 0, time_left, tolerance(radius),
                                 [&] { return rounding_speed(key, v); });
      if (key.time < kNever) offer(wall.at(x[i]).normal);
    }
  }
  // Pieces that end in a contact without an impulse count too, so that their number is limited.
  if (first.key.time < kNever && events_ == events_at_last_cut_) count_event(first.key);
  events_at_last_cut_ = events_;
  return first;
}

template class ContactScan<2>;
template class ContactScan<3>;

}  // namespace carom
