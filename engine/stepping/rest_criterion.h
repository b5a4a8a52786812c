// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// When a contact counts as at rest. Contacts without a law rest at the level of rounding, because bouncing would repeat
// without end. Contacts that dissipate also rest below the rest speed of their law.
//
//   from      to        when; u is the normal speed, positive where the gap opens   energy
//   free      touching  gap ≤ noticed_gap()                                         none
//   touching  touching  Next::hits, u < −stopping: an impulse, if the gap is        ½ m (1 − e²) u² dissipated
//                       closed or a partner touches another sphere
//   touching  held      Next::stops, −stopping ≤ u < −resting: a reaction stops     ½ m u² dissipated; without a
//                       the approach                                                law returned (edda, cdda)
//   touching  held      Next::rests, −resting ≤ u ≤ holding: the contact closes     as above, at the end of the piece
//                       again by the end of the piece
//   touching  free      Next::parts, u > holding                                    none
//   held      held      the reaction that keeps it from approaching is positive     its work: of a wall, or folded
//   held      free      that reaction is zero                                       none
//   held      touching  a partner is hit, or the contact falls back: the piece      none
//                       ends there
//
// RestCriterion::limits() gives the three speeds. ContactScan::find_touching() notices contacts, sort_out() decides
// between the rows from `touching`, hold() and hold_means() between those from `held`, and SlabCore::serve() finds what
// ends a piece.

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "engine/base/particles.h"
#include "engine/events/contact.h"
#include "engine/events/step_event.h"
#include "engine/laws/box.h"
#include "engine/laws/interaction.h"
#include "engine/stepping/resting.h"

namespace carom {

/// What a contact that touches does next.
enum class Next { hits, stops, rests, parts };

/// The normal speeds that decide what a contact does next.
struct RestLimits {
  /// The rounding error, or a speed at which the forces on the spheres close the contact again before it has opened by
  /// kRestingGap.
  double resting;
  /// The resting speed or, if the contact dissipates, the rest speed of its law, and what kicks add to it.
  double stopping;
  /// The resting speed or, if the contact dissipates, one at which it closes again within the step so slowly that it
  /// stops.
  double holding;
  Next next(double u) const {
    if (u < -stopping) return Next::hits;
    if (u < -resting) return Next::stops;
    return u <= holding ? Next::rests : Next::parts;
  }
};

/// A resting contact and the force that keeps its spheres apart.
template <int D>
struct Reaction {
  EventKey<D> key;   ///< without time and generation
  double force = 0;  ///< on lo along the normal, and its negative on hi [force]
};

/// The key of a resting contact: its partners alone.
template <int D>
EventKey<D> without_time(EventKey<D> key) {
  key.time = 0;
  key.generation = 0;
  return key;
}

/// The core or the tether with which two particles at this distance have a contact.
template <int D>
HardSurface hard_surface(const Box<D>& box, const Particles<D>& p, Id i, Id j, double distance) {
  const double sigma = p.radius[i] + p.radius[j];
  if (box.steps.empty()) return {sigma};
  return hard_surface(box.steps, p.id_of(i), p.id_of(j), sigma, distance);
}

/// The gradient of the gap of a contact at x, up to a positive factor: of a pair x_lo − x_hi, or at a tether its
/// negative.
template <int D>
Vec<D> contact_normal(const Box<D>& box, const Particles<D>& p, const EventKey<D>& key, Positions<D> x) {
  if (key.kind == EventKind::wall) return box.wall(key.hi).at(x[key.lo]).normal;
  Vec<D> d = x[key.lo] - x[key.hi] + box.shift(key.image);
  if (!box.steps.empty()) d *= hard_surface(box, p, key.lo, key.hi, d.norm()).side;
  return d;
}

template <int D>
class RestCriterion {
 public:
  /// `reactions`: of the last piece, in the order of their keys.
  RestCriterion(const Box<D>& box, const Particles<D>& particles, const std::vector<Reaction<D>>& reactions)
      : box_(box), particles_(particles), reactions_(reactions) {}

  /// Starts a step of this length with these accelerations, without reactions; they may be null, or empty.
  void begin_step(const std::vector<Vec<D>>* a, double length);
  /// Call this when the reactions have changed.
  void note_reactions();
  /// For methods that kick: within this time the kick that presses partners together counts as slow [time].
  void stop_within(double time) { kick_ = time; }
  bool kicks() const { return kick_ > 0; }
  double kick() const { return kick_; }  ///< that time, or 0
  /// For methods that cut the step at each contact: contacts that open more than by rounding are not held.
  void let_open() { lets_open_ = true; }

  /// The core or the tether at which a pair with this normal, as long as the pair is apart, has a contact.
  HardSurface surface(const EventKey<D>& key, const Vec<D>& normal) const {
    if (box_.steps.empty()) return {distance(key)};
    return hard_surface(box_, particles_, key.lo, key.hi, normal.norm());
  }
  /// The contact distance of the cores, or the radius at a wall.
  double distance(const EventKey<D>& key) const {
    if (key.kind != EventKind::pair) return particles_.radius[key.lo];
    return box_.steps.core_distance(particles_.id_of(key.lo), particles_.id_of(key.hi),
                                    particles_.radius[key.lo] + particles_.radius[key.hi]);
  }
  /// The reaction of the last piece; 0 if there is none.
  double known_force(const EventKey<D>& key) const;
  /// Whether the law of the contact takes energy. That of a thermal wall has no effect.
  bool dissipates(const EventKey<D>& key) const;

  /// Upper bound of the rounding error of a contact's normal speed that the motion of sphere i and the forces on it
  /// cause; for a pair, add the values of both spheres [length/time].
  double rounding_speed(Id i, const Vec<D>& v) const {
    double speed = v.norm();
    if (a_ && i < a_->size()) speed += length_ * (*a_)[i].norm();
    if (!pressed_.empty()) speed += length_ * pressed_[i];
    return kRounding * speed;
  }
  /// The limits of a contact with this normal (contact_normal()) and reaction. Nothing rests on a thermal wall.
  RestLimits limits(const EventKey<D>& key, const Vec<D>& normal, double force, const Vec<D>& v_lo,
                    const Vec<D>& v_hi) const;
  /// The largest gap of this contact from which a slow approach stops, and with which it is held; 0 unless it
  /// dissipates. It is a quarter of the height from which a fall gives the rest speed, or of kRestHeight contact
  /// distances if this is less, but at least what a sphere crosses at that speed in a 64th of the step. It must not
  /// shrink with the step: held spheres would fall in a shorter step. Without forces no contact is held; the gap is
  /// then the rest speed times the step. See rest_criterion.cc for methods that kick.
  double widest_gap(const EventKey<D>& key, const Vec<D>& normal) const;
  /// No widest_gap() is larger than this.
  double widest_gap() const;
  /// The rest speed of the contact's law, 0 unless it dissipates. The default is the speed that a fall from kRestHeight
  /// contact distances gives under the forces on its spheres, or ContactLaw::slowest() if that is faster: forces that
  /// push the spheres apart give none, and neither does a gas without forces.
  double rest_speed(const EventKey<D>& key, const Vec<D>& normal) const;

  /// Whether a contact that opens at this speed, and closes again with this acceleration, rests; it does until the end
  /// of the step. False if this is known already.
  bool falls_back(const EventKey<D>& key, const Vec<D>& normal, double closing, double speed);

 private:
  const ContactLaw& law_of(const EventKey<D>& key) const;  // unless all contacts are elastic
  double pressing(const EventKey<D>& key, const Vec<D>& normal, double force) const;
  double opening_by_forces(const EventKey<D>& key, const Vec<D>& normal) const;
  double slowest_impact(const EventKey<D>& key, const Vec<D>& normal, double closing) const;
  double slowest_bounce(const EventKey<D>& key, const Vec<D>& normal, double closing) const;
  double inverse_mass(const EventKey<D>& key) const {
    return 1 / particles_.mass[key.lo] + (key.kind == EventKind::pair ? 1 / particles_.mass[key.hi] : 0.0);
  }
  double acceleration(Id i) const { return a_ && i < a_->size() ? (*a_)[i].norm() : 0; }
  double strongest(const EventKey<D>& key) const {
    return key.kind == EventKind::pair ? std::max(acceleration(key.lo), acceleration(key.hi)) : acceleration(key.lo);
  }
  static constexpr double kOfHeight = 0.25;
  double gap_of(double speed, double strongest, double sigma) const {
    if (!(strongest > 0)) return speed * length_;
    const double height = std::min(speed * speed / (2 * strongest), kRestHeight * sigma);
    return std::max(kOfHeight * height, speed * length_ / kMostBounces);
  }
  double speed_of_rest(double closing, double sigma) const {
    return std::min(std::sqrt(2 * closing * kRestingGap * sigma), 0.5 * closing * length_ / kMostBounces);
  }

  const Box<D>& box_;
  const Particles<D>& particles_;
  const std::vector<Reaction<D>>& reactions_;
  const std::vector<Vec<D>>* a_ = nullptr;
  double length_ = 0, kick_ = 0;
  bool lets_open_ = false;
  std::vector<double> pressed_;  // by particle: Σ |acceleration| over its reactions
  std::vector<Vec<D>> held_;     // by particle: its acceleration by reactions; empty if no contact dissipates
  std::vector<std::pair<EventKey<D>, double>> fallen_back_;  // contacts, and the accelerations that closed them again
};

}  // namespace carom
