// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The elastic collision: momentum and kinetic energy to the last bit that rounding leaves.

#include "engine/base/vec.h"

namespace carom {

/// The factor g of the impulse g·d that the first sphere receives and the second gives, d = x_i − x_j at contact,
/// v = v_i − v_j. d is not normalised: a unit vector with a length off by an ulp would change the energy by the same
/// sign at every collision. Where the contact distance sigma grows at the rate w the collision is elastic in the frame
/// of the moving surfaces, so that the spheres part faster than they grow: d·v − sigma w changes sign. It adds energy.
template <int D>
double collision_factor(const Vec<D>& d, const Vec<D>& v, double mass_i, double mass_j, double sigma = 0,
                        double w = 0) {
  return -2 * (d.dot(v) - sigma * w) / (d.squaredNorm() * (1 / mass_i + 1 / mass_j));
}

}  // namespace carom
