// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The tangential part of a contact between rough spheres, or of a rough sphere and a wall: an impulse at the point of
// contact that is normal to the line of centres and changes spins (Walton, in: Particulate Two-Phase Flow (1993) 884).
//
// With the slip s, the tangential velocity of one surface relative to the other, and the mass 1/m = Σ (1/m_i +
// a_i²/I_i) that resists it (a: arm, I: moment of inertia), the impulse −q m s leaves the slip (1 − q) s. It is q = 1 +
// β or, if that takes more than μ times the normal impulse J, q = μJ/(m|s|). The energy lost is q (1 − q/2) m s²: 0 for
// β = ±1.
//
// The arms from the two centres add up to d = x_i − x_j, not to the sum of the radii, from which |d| differs by
// rounding. So the angular momentum, Σ m x × v + I ω, is conserved to rounding. Exchanging the spheres gives the
// same bits.

#include <cmath>

#include "engine/base/contact_law.h"
#include "engine/base/vec.h"

namespace carom {

/// A sphere in a rough contact.
template <int D>
struct RoughSphere {
  double mass, radius, inertia;  ///< inertia: the reduced one, κ = I/mr²
  Spin<D>* spin;                 ///< changes in the contact
  double moment() const { return inertia * mass * radius * radius; }
};

template <int D>
struct Rubbed {
  Vec<D> impulse;     ///< on the first sphere
  double dissipated;  ///< energy lost
};

/// `resisting`: 1/m above; `pressing`: the normal impulse.
template <int D>
Rubbed<D> rub(const ContactLaw& law, const Vec<D>& slip, double resisting, double pressing) {
  const double square = slip.squaredNorm(), most = law.friction * pressing * resisting;
  double q = 1 + *law.tangential;
  if (q * q * square > most * most) q = most / std::sqrt(square);
  return {(-q / resisting) * slip, q * (1 - 0.5 * q) * square / resisting};
}

/// A contact of two spheres with d = x_a − x_b and the relative velocity v = v_a − v_b.
template <int D>
Rubbed<D> rub_pair(const ContactLaw& law, const Vec<D>& d, const Vec<D>& v, double pressing, const RoughSphere<D>& a,
                   const RoughSphere<D>& b) {
  const double sigma = a.radius + b.radius;
  const Vec<D> arm_a = (a.radius / sigma) * d, arm_b = (b.radius / sigma) * d;
  Vec<D> slip = v - (turned<D>(*a.spin, arm_a) + turned<D>(*b.spin, arm_b));
  slip -= (slip.dot(d) / d.squaredNorm()) * d;
  const double resisting =
      (1 / a.mass + 1 / b.mass) + (arm_a.squaredNorm() / a.moment() + arm_b.squaredNorm() / b.moment());
  const Rubbed<D> rubbed = rub<D>(law, slip, resisting, pressing);
  *a.spin -= torque<D>(arm_a, rubbed.impulse) / a.moment();
  *b.spin -= torque<D>(arm_b, rubbed.impulse) / b.moment();
  return rubbed;
}

/// A contact of a sphere with velocity v and a wall, which moves along its normal only.
template <int D>
Rubbed<D> rub_wall(const ContactLaw& law, const Vec<D>& normal, const Vec<D>& v, double pressing,
                   const RoughSphere<D>& a) {
  const Vec<D> arm = a.radius * normal;
  Vec<D> slip = v - turned<D>(*a.spin, arm);
  slip -= slip.dot(normal) * normal;
  const Rubbed<D> rubbed = rub<D>(law, slip, 1 / a.mass + arm.squaredNorm() / a.moment(), pressing);
  *a.spin -= torque<D>(arm, rubbed.impulse) / a.moment();
  return rubbed;
}

}  // namespace carom
