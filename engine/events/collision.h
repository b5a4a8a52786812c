// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The elastic collision, which conserves momentum and kinetic energy to rounding.

#include "engine/base/vec.h"

namespace carom {

/// The factor g of the impulse: the first sphere receives g·d, the second −g·d, with d = x_i − x_j at contact and v =
/// v_i − v_j. d is not normalised: a unit vector that is wrong by an ulp would change the energy with the same
/// sign at every collision. If the contact distance sigma grows at the rate w, the collision is elastic in the frame of
/// the moving surfaces: d·v − sigma w changes sign, the spheres separate faster than they grow, and the collision adds
/// energy.
template <int D>
double collision_factor(const Vec<D>& d, const Vec<D>& v, double mass_i, double mass_j, double sigma = 0,
                        double w = 0) {
  return -2 * (d.dot(v) - sigma * w) / (d.squaredNorm() * (1 / mass_i + 1 / mass_j));
}

}  // namespace carom
