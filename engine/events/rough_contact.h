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

#include <cstdint>

#include "engine/base/particles.h"
#include "engine/laws/contact_law.h"

namespace carom {

/// A sphere in a contact.
template <int D>
struct Partner {
  double mass, radius;
  std::uint16_t species;
  Internal<D>* internal = nullptr;  ///< changes in the contact; null: spheres have none
};

template <int D>
struct TangentialImpulse {
  Vec<D> impulse = Vec<D>::Zero();  ///< on the first sphere
  double dissipated = 0;            ///< energy lost
};

/// A contact of two spheres with d = x_a − x_b and the relative velocity v = v_a − v_b before it; its normal impulse is
/// factor·d.
template <int D>
TangentialImpulse<D> rub_pair(const ContactLaws& laws, const Vec<D>& d, const Vec<D>& v, double factor,
                              const Partner<D>& a, const Partner<D>& b);

/// A contact of a sphere with velocity v and a wall, which moves along its normal only: the normal speed of approach
/// and the normal impulse.
template <int D>
TangentialImpulse<D> rub_wall(const ContactLaws& laws, std::uint32_t wall, const Vec<D>& normal, const Vec<D>& v,
                              double closing, double pressing, const Partner<D>& a);

}  // namespace carom
