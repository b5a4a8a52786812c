// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Contacts for the integrators that cut the step of all particles (cva, mcva, cdda): which pairs touch now, and which
// pair touches first. The slab core gets its candidate pairs and its resting contacts from here, too.
//
// Pairs come from a Verlet list with the radii as reach, walls from the box. Contacts have the keys of the event core,
// so the order of simultaneous impulses is the same in all methods.

#include <functional>
#include <vector>

#include "engine/events/contact.h"
#include "engine/laws/contact_log.h"
#include "engine/laws/counters.h"
#include "engine/ranks/system.h"
#include "engine/search/neighbour_list.h"
#include "engine/stepping/rest_criterion.h"
#include "engine/stepping/slab_watch.h"

namespace carom {

/// A present or future contact and its normal: the gradient of the gap, up to a positive factor.
template <int D>
struct Touch {
  EventKey<D> key;  ///< key.time counts from now for a future contact
  Vec<D> normal;  ///< pair: x_lo − x_hi, acting on lo, and its negative on hi; wall: unit vector inwards, acting on lo;
                  ///< at a tether: x_hi − x_lo
  double speed = 0;     ///< velocity of a wall along its normal
  double force = 0;     ///< the reaction of a present contact in the last piece [force]
  double gap = 0;       ///< of a present contact [length]
  bool may_hit = true;  ///< an open contact: whether it gets an impulse at once, because a partner has a contact now
  bool tether = false;  ///< the pair pulls at its tether
  bool pair() const { return key.kind == EventKind::pair; }
};

/// Applies the impulse of a contact, which changes velocities; returns the energy that the contact dissipates.
template <int D>
using ApplyImpulse = std::function<double(const Touch<D>&)>;

template <int D>
class ContactScan {
 public:
  /// `max_events` limits the contacts of one step. `reactions` are the reactions of the last piece; they are state of
  /// the run and must outlive the scan.
  ContactScan(const System<D>& system, std::uint64_t max_events, std::vector<Reaction<D>>& reactions);

  /// Starts a step, or a part of one, of this length: counts from `already`, the contacts of its earlier parts, and
  /// logs to `contacts` (may be null). `a` (may be null, or empty) holds the accelerations that forces cause, without
  /// reactions; it must outlive the step and may change within it. `watch` (may be null) is called before each impulse
  /// of resolve().
  void begin_step(Counters& counters, std::vector<Contact<D>>* contacts, const std::vector<Vec<D>>* a, double length,
                  SlabWatch* watch = nullptr, std::uint64_t already = 0);

  /// Applies `impulse`, which changes the velocities in `v`, to every contact that touches and approaches at x, in key
  /// order, until no contact approaches, and records which contacts rest. Returns the energy that contacts lost when
  /// they came to rest. Throws Error(Failure::numerical) beyond max_events.
  double resolve(double time, Positions<D> x, Vectors<D> v, const ApplyImpulse<D>& impulse);

  /// Finds the contacts at this time in the step; returns whether one approaches or rests.
  bool find_contacts(double time, Positions<D> x, Positions<D> v) {
    find_touching(time, x);
    sort_out(v);
    return !approaching_.empty() || !resting_.empty();
  }

  /// The contacts that the last resolve() found at rest; none of them approaches any more.
  std::span<RestingContact<D>> resting() { return resting_; }
  bool rests(const EventKey<D>& key) const;

  /// Keeps resting contacts from approaching for a time `time_left`: adds the reactions to the accelerations a.
  /// Contacts without a reaction no longer count as resting.
  void hold(Positions<D> v, Vectors<D> a, double time_left);

  /// Keeps resting contacts from approaching for the mean velocities w = v + ½ length a of a discrete-gradient piece
  /// from x, which ends at x + length · w_before. The reactions do no work, except where they correct a contact that
  /// rounding has opened or closed. `length` is negative for a piece back in time. Returns whether the reactions were
  /// found to rounding.
  bool hold_means(Positions<D> x, Positions<D> w_before, Vectors<D> w, double length);

  /// Stops the approach of resting contacts at new positions; returns the energy that they lose. `kick`: the length
  /// of the kick that caused the approach [time], and the reactions are kept for remember(); 0: none is kept.
  double stop_approach(Positions<D> x, Vectors<D> v, double kick = 0);

  /// Drops resting contacts that have opened.
  void drop_open(Positions<D> x);

  /// The first contact on the parabolas x + v s + a s²/2 within [0, time_left); key.time is kNever when there is none.
  /// Call resolve() first; contacts held at rest are not searched for.
  Touch<D> earliest(Positions<D> x, Positions<D> v, Positions<D> a, double time_left);

  /// Call this when a piece of this length [time] is accepted, before the box moves on. It counts the work of moving
  /// walls on spheres at rest on them and stores the reactions, from which the next solve starts.
  void remember(double length);

  /// Makes the velocities of contacts that were held over a piece tangential at its end, x, and conserves their energy
  /// (the normal velocity that a held piece of finite length leaves would make the pair bounce at once). Returns the
  /// energy that is missing afterwards. The piece ends `later` after the present time of the box. Contacts of spheres
  /// that are `hit`, because an event within the piece has changed their velocities, are left out.
  double slide(Positions<D> x, Vectors<D> v, double later = 0, const std::function<bool(Id)>& hit = {});
  /// Whether all held contacts approach or open more slowly than their rest speeds, so that slide() ends slow motion
  /// and does not turn a fast pair.
  bool held_slowly(Positions<D> x, Positions<D> v, double later, const std::function<bool(Id)>& hit) const;

  /// The candidate pairs, for methods that search for contacts themselves.
  NeighbourList<D>& list() { return list_; }

  const Box<D>& box() const { return box_; }
  /// The mean velocity of a wall along its normal over a piece that starts now.
  double mean_speed(Id wall, double length) const { return box_.wall(wall).velocity_at(0.5 * length); }

  double contact_distance(Id i, Id j) const {
    const double sigma = particles_.radius[i] + particles_.radius[j];
    return box_.steps.empty() ? sigma : box_.steps.core_distance(particles_.id_of(i), particles_.id_of(j), sigma);
  }
  /// The steps of two particles; null: they have none.
  const PairSteps* steps(Id i, Id j) const {
    if (box_.steps.empty()) return nullptr;
    return box_.steps.find(particles_.id_of(i), particles_.species[i], particles_.id_of(j), particles_.species[j]);
  }
  double tolerance(double sigma) const { return tolerance_(sigma); }
  /// Whether spheres at separation d touch.
  bool touches(const Vec<D>& d, double sigma) const {
    const double reach = sigma + tolerance(sigma);
    return d.squaredNorm() <= reach * reach;
  }
  /// The smallest gap that a piece may end with if the contact touches at its start: a contact that rounding has left
  /// at the edge of the tolerance must be able to separate.
  double floor(double gap_at_start, double tolerance) const {
    return std::min(-tolerance, gap_at_start - std::numeric_limits<double>::epsilon() * box_.edges.maxCoeff());
  }
  /// The walls from the present time of the box on.
  std::span<const Wall<D>> walls() {
    if (std::exchange(walls_at_, box_.time) != box_.time) walls_ = box_.walls();
    return walls_;
  }

  /// Counts one more contact or piece of length zero; throws if the step needs more than max_events.
  void count_event(const EventKey<D>& key);

  /// Counts and logs contacts that the caller has found and executed; their times count from `time` in the step.
  void commit(double time, std::span<const Contact<D>> executed);

  /// See RestCriterion::rounding_speed.
  double rounding_speed(Id i, const Vec<D>& v) const { return rest_.rounding_speed(i, v); }
  /// What a contact with this normal, of any length, and normal speed does next.
  Next next(const EventKey<D>& key, const Vec<D>& normal, double speed, const Vec<D>& v_lo, const Vec<D>& v_hi) const {
    return rest_.limits(key, normal, rest_.known_force(key), v_lo, v_hi).next(speed);
  }

  RestCriterion<D>& rest() { return rest_; }
  const RestCriterion<D>& rest() const { return rest_; }

 private:
  bool open(const Touch<D>& touch) const { return touch.gap > tolerance(rest_.distance(touch.key)); }
  /// The largest gap with which a contact is put into touching_.
  double noticed_gap(const EventKey<D>& key, const Vec<D>& normal) const {
    return std::max(tolerance(rest_.distance(key)), rest_.widest_gap(key, normal));
  }
  void note_open();
  double count_dissipated(Positions<D> before, Positions<D> after);
  void find_touching(double time, Positions<D> x);
  void sort_out(Positions<D> v, bool all_stop = false);
  double rounding_speed(const EventKey<D>& key, Positions<D> v) const {
    return rounding_speed(key.lo, v[key.lo]) + (key.kind == EventKind::pair ? rounding_speed(key.hi, v[key.hi]) : 0.0);
  }
  Next next(const Touch<D>& touch, Positions<D> v) const {
    const Vec<D>&v_lo = v[touch.key.lo], &v_hi = touch.pair() ? v[touch.key.hi] : v_lo;
    return rest_.limits(touch.key, touch.normal, touch.force, v_lo, v_hi).next(normal_speed(touch, v));
  }
  void one_by_one(std::uint32_t generation, Positions<D> x, Vectors<D> v, const ApplyImpulse<D>& impulse);
  /// `gained`: the change of the kinetic energy of lo.
  void record(const Touch<D>& touch, Positions<D> x, Positions<D> v, const Vec<D>& impulse, double dissipated,
              double gained);
  double wall_speed(const EventKey<D>& key, double later = 0) const {
    return key.kind == EventKind::wall ? box_.wall(key.hi).velocity_at(later) : 0.0;
  }
  double count_push(const RestingContact<D>& contact, double impulse, double speed);
  double stop_rounding(Vectors<D> v) const;
  Vec<D> normal(const EventKey<D>& key, Positions<D> x) const { return contact_normal<D>(box_, particles_, key, x); }
  /// Whether one of the partners is hit.
  static bool was_hit(const EventKey<D>& key, const std::function<bool(Id)>& hit) {
    return hit && (hit(key.lo) || (key.kind == EventKind::pair && hit(key.hi)));
  }
  double least_opening(const RestingContact<D>& contact, Positions<D> v, Positions<D> a, double time_left) const;
  double least_pull(const RestingContact<D>& contact, Positions<D> x, Positions<D> v) const;
  double normal_slack(const RestingContact<D>& contact, Positions<D> v) const;
  bool press_apart(Vectors<D> w, double force);
  double normal_speed(const Touch<D>& touch, Positions<D> v) const;

  const Box<D>& box_;
  const Particles<D>& particles_;
  std::vector<Wall<D>> walls_;
  double walls_at_;  // the time of walls_
  GapTolerance tolerance_;
  NeighbourList<D> list_;
  bool keeps_momentum_;
  std::uint64_t max_events_;
  std::uint64_t events_ = 0, events_at_last_cut_ = 0;
  Counters* counters_ = nullptr;
  std::vector<Contact<D>>* contacts_ = nullptr;
  SlabWatch* watch_ = nullptr;
  double widest_ = 0;  // the largest gap with which a contact is put into touching_
  std::vector<Reaction<D>>& reactions_;
  RestCriterion<D> rest_;
  std::vector<Touch<D>> touching_, approaching_;
  std::vector<RestingContact<D>> resting_;
  ReactionSolver<D> solver_;  // of press_apart()
};

}  // namespace carom
