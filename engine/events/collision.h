// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The one place that resolves a contact, of two spheres or of a sphere and a wall. An elastic contact conserves the
// kinetic energy to rounding, any contact of two spheres their momentum and their angular momentum.

#include "engine/base/box.h"
#include "engine/base/contact_log.h"
#include "engine/base/particles.h"
#include "engine/events/rough_contact.h"
#include "engine/events/thermal_contact.h"

namespace carom {

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

/// What a contact does to the first sphere.
struct Impulse {
  double factor;      ///< the impulse is factor·d, or of a wall factor·normal, and what rub_pair() or rub_wall() adds
  double dissipated;  ///< energy lost
};

/// The normal part of a contact of two spheres, with d as above; the contact distance grows at the rate w.
template <int D>
[[gnu::always_inline]] inline Impulse pair_impulse(const ContactLaws& laws, std::uint16_t species_i,
                                                   std::uint16_t species_j, const Vec<D>& d, const Vec<D>& v,
                                                   double mass_i, double mass_j, double sigma = 0, double w = 0) {
  if (laws.elastic()) return {collision_factor<D>(d, v, mass_i, mass_j, sigma, w), 0};
  const double closing = -(d.dot(v) - sigma * w), square = closing * closing / d.squaredNorm();
  const double e = laws.of_pair(species_i, species_j).at(std::sqrt(square), laws.thermal_speed, laws.slow);
  return {collision_factor<D>(d, v, mass_i, mass_j, sigma, w, e),
          0.5 * (1 - e * e) * square / (1 / mass_i + 1 / mass_j)};
}

/// The velocity of a sphere after a contact with a wall, and what was exchanged.
template <int D>
struct Bounced {
  Vec<D> v, impulse;
  Exchange exchange;
};

/// A contact at time t with a wall, of a sphere with velocity v and a radius that grows at `rate`; `draw` matters for
/// thermal walls only, `radius` and `spin`, which changes, for rough contacts.
template <int D>
Bounced<D> wall_impulse(const ContactLaws& laws, const Wall<D>& wall, std::uint16_t species, double mass,
                        const Vec<D>& v, const Draw& draw, double t = 0, double rate = 0, double radius = 0,
                        Spin<D>* spin = nullptr) {
  if (wall.thermal()) {
    const Vec<D> after = thermal_velocity(wall, mass, draw, t), impulse = mass * (after - v);
    const double work = wall.work(impulse, t), gained = 0.5 * mass * (after.squaredNorm() - v.squaredNorm());
    return {after, impulse, {.impulse = wall.along_normal(impulse), .work = work, .heat = gained - work}};
  }
  const double closing = rate - wall.opening(v, t);
  const double e = laws.elastic() ? 1 : laws.of_wall(species, wall.number).at(closing, laws.thermal_speed, laws.slow);
  const Vec<D> after = wall.bounced(v, t, rate, e);
  const Vec<D> impulse = mass * (after - v);
  Bounced<D> bounced{after,
                     impulse,
                     {.impulse = wall.along_normal(impulse),
                      .work = wall.work(impulse, t),
                      .dissipated = 0.5 * (1 - e * e) * mass * closing * closing}};
  if (!spin) return bounced;
  const Rubbed<D> rubbed =
      rub_wall<D>(laws, wall.number, wall.normal, v, closing, bounced.exchange.impulse, {mass, radius, species, spin});
  bounced.v += rubbed.impulse / mass;
  bounced.impulse += rubbed.impulse;
  bounced.exchange.dissipated += rubbed.dissipated;
  return bounced;
}

/// The spin of a particle, for contacts; null if none is rough.
template <int D>
Spin<D>* spin_of(const Box<D>& box, Particles<D>& p, Id i) {
  return box.contacts.rough() ? &p.spin[i] : nullptr;
}

/// Resolves a contact of two of these particles, or of one and a wall, now: changes their velocities and spins, and
/// returns the energy lost. `d`: x_lo − x_hi of the image that is touched.
template <int D>
double resolve_contact(const EventKey<D>& key, const Vec<D>& d, const Box<D>& box, Particles<D>& p) {
  const Id lo = key.lo, hi = key.hi;
  if (key.kind == EventKind::wall) {
    const auto [after, impulse, exchange] = wall_impulse<D>(
        box.contacts, box.wall(hi), p.species[lo], p.mass[lo], p.v[lo],
        {.id = p.id_of(lo), .time = box.time, .number = key.generation}, 0, 0, p.radius[lo], spin_of(box, p, lo));
    p.v[lo] = after;
    return exchange.dissipated;
  }
  const Vec<D> v = p.v[lo] - p.v[hi];
  const auto [g, dissipated] =
      pair_impulse<D>(box.contacts, p.species[lo], p.species[hi], d, v, p.mass[lo], p.mass[hi]);
  p.v[lo] += (g / p.mass[lo]) * d;
  p.v[hi] -= (g / p.mass[hi]) * d;
  if (!box.contacts.rough()) return dissipated;
  const auto sphere = [&](Id i) { return RoughSphere<D>{p.mass[i], p.radius[i], p.species[i], &p.spin[i]}; };
  const Rubbed<D> rubbed = rub_pair<D>(box.contacts, d, v, g, sphere(lo), sphere(hi));
  p.v[lo] += rubbed.impulse / p.mass[lo];
  p.v[hi] -= rubbed.impulse / p.mass[hi];
  return dissipated + rubbed.dissipated;
}

}  // namespace carom
