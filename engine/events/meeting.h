// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A meeting of two spheres, or of a sphere and a wall: when it comes, and what it does. All methods take both from
// here.
//
// The times of two spheres are in contact.h. An elastic contact conserves the kinetic energy to rounding, any contact
// of two spheres their momentum and their angular momentum.

#include "engine/base/particles.h"
#include "engine/events/contact.h"
#include "engine/events/rough_contact.h"
#include "engine/events/shaken_contact.h"
#include "engine/events/thermal_contact.h"
#include "engine/laws/box.h"
#include "engine/laws/contact_log.h"

namespace carom {

/// wall_meeting() of a round wall: the sphere meets the centre, or a point of the axis, at the distance reach(), from
/// the inside or from the outside. Spheres grow only where they fly straight.
template <int D, class Slack>
[[gnu::noinline]] double round_wall_meeting(const Wall<D>& wall, const Vec<D>& x, const Vec<D>& v, const Vec<D>& a,
                                            double radius, double rate, double time_left, double tolerance,
                                            Slack&& slack) {
  const PairMotion<D> motion{wall.from_centre(x), wall.across(v)};
  const Vec<D> bend = wall.across(a);
  const double reach = wall.reach(radius);
  const bool touching = wall.gap(x, radius) <= tolerance;
  const double least = touching ? reach * slack() : 0.0;
  if (!bend.isZero(0))
    return wall.inside ? leaving_time(motion, bend, reach, time_left, touching, least)
                       : contact_time<D>(motion.d, motion.v, bend, reach, time_left, touching, least);
  const double s =
      wall.inside ? leaving_time(motion, reach, least, rate) : contact_time<D>(motion.d, motion.v, reach, rate, least);
  return s < time_left ? s : kNever;
}

/// The time, from t on and before `time_left`, until a sphere that moves on x + v s + a s²/2 meets a wall, while its
/// radius grows at `rate`: from the front or, if it is on its way through a one-way wall, when it has come back. A gap
/// up to `tolerance` touches; `slack()` returns the largest speed of approach that rounding alone can cause for a
/// sphere that touches (contact.h).
template <int D, class Slack>
double wall_meeting(const Wall<D>& wall, const Vec<D>& x, const Vec<D>& v, const Vec<D>& a, double radius, double rate,
                    double t, double time_left, double tolerance, Slack&& slack) {
  if (wall.round > 0) [[unlikely]]
    return round_wall_meeting(wall, x, v, a, radius, rate, time_left, tolerance, slack);
  const double gap = wall.gap(x, radius, t), opening = wall.opening(v, t) - rate, speeding = wall.speeding(a);
  if (wall.one_way && !(gap < kNever)) return return_time(wall.clearance(x, radius, t), opening, speeding, time_left);
  const bool touching = gap <= tolerance;
  if (wall.amplitude == 0)
    return wall_contact_time(gap, opening, speeding, time_left, touching, touching ? slack() : 0.0);
  if (!(gap < kNever)) return kNever;
  const ShakenGap shaken{.y = wall.normal.dot(x) - (wall.offset + wall.velocity * t) - radius,
                         .v = wall.along_normal(v) - wall.velocity - rate,
                         .a = wall.along_normal(a),
                         .amplitude = wall.amplitude,
                         .frequency = wall.frequency,
                         .turns = wall.turns + wall.frequency * t};
  return shaken.first_contact(time_left, touching, touching ? slack() : 0.0);
}

/// The factor g of the impulse: the first sphere receives g·d, the second −g·d, with d = x_i − x_j at contact and v =
/// v_i − v_j. d is not normalised: a unit vector that is wrong by an ulp would change the energy with the same
/// sign at every collision. If the contact distance sigma grows at the rate w, the collision is elastic in the frame of
/// the moving surfaces: d·v − sigma w changes sign, the spheres separate faster than they grow, and the collision adds
/// energy. `e` is the coefficient of restitution.
template <int D>
double collision_factor(const Vec<D>& d, const Vec<D>& v, double mass_i, double mass_j, double sigma = 0, double w = 0,
                        double e = 1) {
  return -(1 + e) * (d.dot(v) - sigma * w) / (d.squaredNorm() * (1 / mass_i + 1 / mass_j));
}

/// What an event does to the first of two spheres; the second gets the opposite impulse.
template <int D>
struct PairImpulse {
  double factor = 0;      ///< the impulse is factor·d + rubbed
  double dissipated = 0;  ///< energy lost
  bool rough = false;     ///< whether `rubbed` is set
  Vec<D> rubbed{};        ///< the tangential part
  double stored = 0;      ///< energy that a step takes from the motion
  PairEvent event = PairEvent::core;

  Vec<D> on_first(const Vec<D>& d) const {
    Vec<D> all = factor * d;
    if (rough) all += rubbed;
    return all;
  }
  void apply(const Vec<D>& d, double mass_a, Vec<D>& v_a, double mass_b, Vec<D>& v_b) const {
    v_a += (factor / mass_a) * d;
    v_b -= (factor / mass_b) * d;
    if (!rough) return;
    v_a += rubbed / mass_a;
    v_b -= rubbed / mass_b;
  }
};

/// The normal part of a contact of two spheres with the relative velocity v before it, and d as above; the contact
/// distance grows at the rate w.
template <int D>
[[gnu::always_inline]] inline PairImpulse<D> normal_impulse(const ContactLaws& laws, const Vec<D>& d, const Vec<D>& v,
                                                            const Partner<D>& a, const Partner<D>& b, double sigma = 0,
                                                            double w = 0) {
  if (laws.elastic()) return {.factor = collision_factor<D>(d, v, a.mass, b.mass, sigma, w)};
  const double closing = -(d.dot(v) - sigma * w), square = closing * closing / d.squaredNorm();
  const double inverse_mass = 1 / a.mass + 1 / b.mass;
  const double e =
      laws.of_pair(a.species, b.species)
          .restitution_at({std::sqrt(square), inverse_mass}, laws.thermal_speed, laws.restitution_when_slow);
  // 1 − e² by the rounded 1 + e of the impulse: else the ledger would be off by the same part of each loss.
  const double returned = 1 + e;
  return {.factor = collision_factor<D>(d, v, a.mass, b.mass, sigma, w, e),
          .dissipated = 0.5 * returned * (2 - returned) * square / inverse_mass};
}

/// A contact of two spheres, which may change their internal states.
template <int D>
PairImpulse<D> pair_impulse(const ContactLaws& laws, const Vec<D>& d, const Vec<D>& v, const Partner<D>& a,
                            const Partner<D>& b, double sigma = 0, double w = 0) {
  PairImpulse<D> impulse = normal_impulse<D>(laws, d, v, a, b, sigma, w);
  if (!a.internal || !laws.rough()) return impulse;
  const TangentialImpulse<D> rubbed = rub_pair<D>(laws, d, v, impulse.factor, a, b);
  impulse.rough = true;
  impulse.rubbed = rubbed.impulse;
  impulse.dissipated += rubbed.dissipated;
  return impulse;
}

/// The velocity of a sphere after a contact with a wall, and what was exchanged.
template <int D>
struct WallImpulse {
  Vec<D> v, impulse;
  Exchange exchange;
};

/// A contact at time t of a sphere with velocity v with a wall, as it is where the sphere touches it (Wall::at()),
/// while the radius of the sphere grows at `rate`. Its internal state may change; `draw` matters for thermal walls
/// only.
template <int D>
WallImpulse<D> wall_impulse(const ContactLaws& laws, const Wall<D>& wall, const Vec<D>& v, const Partner<D>& a,
                            const Draw& draw, double t = 0, double rate = 0) {
  if (wall.thermal()) {
    const Vec<D> after = thermal_velocity(wall, a.mass, draw, t), impulse = a.mass * (after - v);
    const double work = wall.work(impulse, t), gained = 0.5 * a.mass * (after.squaredNorm() - v.squaredNorm());
    return {after, impulse, {.impulse = wall.along_normal(impulse), .work = work, .heat = gained - work}};
  }
  const double closing = rate - wall.opening(v, t);
  const double e = laws.elastic()
                       ? 1
                       : laws.of_wall(a.species, wall.number)
                             .restitution_at({closing, 1 / a.mass}, laws.thermal_speed, laws.restitution_when_slow);
  const Vec<D> after = wall.bounced(v, t, rate, e);
  const Vec<D> impulse = a.mass * (after - v);
  WallImpulse<D> bounced{after,
                         impulse,
                         {.impulse = wall.along_normal(impulse),
                          .work = wall.work(impulse, t),
                          .dissipated = 0.5 * (1 - e * e) * a.mass * closing * closing}};
  if (!a.internal || !laws.rough()) return bounced;
  const TangentialImpulse<D> rubbed =
      rub_wall<D>(laws, wall.number, wall.normal, v, closing, bounced.exchange.impulse, a);
  bounced.v += rubbed.impulse / a.mass;
  bounced.impulse += rubbed.impulse;
  bounced.exchange.dissipated += rubbed.dissipated;
  return bounced;
}

/// Resolves a contact of two of these particles, or of one and a wall, now: changes their velocities and internal
/// states, and returns the energy lost. `d`: x_lo − x_hi of the image that is touched; where the pair pulls at its
/// `tether`, there is no friction.
template <int D>
double resolve_contact(const EventKey<D>& key, const Vec<D>& d, const Box<D>& box, Particles<D>& p,
                       bool tether = false) {
  const Id lo = key.lo, hi = key.hi;
  const bool has_internal = box.contacts.need_internal();
  Internal<D> internal[2];
  const auto partner = [&](Id i, int which) {
    if (has_internal) internal[which] = p.internal(i);
    return Partner<D>{p.mass[i], p.radius[i], p.species[i], has_internal ? &internal[which] : nullptr};
  };
  const auto store = [&](Id i, int which) {
    if (has_internal) p.set_internal(i, internal[which]);
  };
  if (key.kind == EventKind::wall) {
    const Draw draw{.id = p.id_of(lo), .time = box.time, .number = key.generation};
    const auto [after, impulse, exchange] =
        wall_impulse<D>(box.contacts, box.wall(hi).at(p.x[lo]), p.v[lo], partner(lo, 0), draw);
    p.v[lo] = after;
    store(lo, 0);
    return exchange.dissipated;
  }
  const Vec<D> v = p.v[lo] - p.v[hi];
  const auto impulse = tether ? normal_impulse<D>(box.contacts, d, v, partner(lo, 0), partner(hi, 1))
                              : pair_impulse<D>(box.contacts, d, v, partner(lo, 0), partner(hi, 1));
  impulse.apply(d, p.mass[lo], p.v[lo], p.mass[hi], p.v[hi]);
  store(lo, 0);
  store(hi, 1);
  return impulse.dissipated;
}

}  // namespace carom
