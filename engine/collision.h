#pragma once
// The elastic collision: momentum and kinetic energy to the last bit that rounding leaves.

#include "engine/vec.h"

namespace carom {

/// The factor g of the impulse g·d that the first sphere receives and the second gives, d = x_i − x_j at contact,
/// v = v_i − v_j. d is not normalised: a unit vector whose length is off by an ulp would change the energy by the same
/// sign at every collision.
template <int D>
double collision_factor(const Vec<D>& d, const Vec<D>& v, double mass_i, double mass_j) {
  return -2 * d.dot(v) / (d.squaredNorm() * (1 / mass_i + 1 / mass_j));
}

}  // namespace carom
