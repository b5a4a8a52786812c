#pragma once
// Resting contacts: pairs that touch, have no normal velocity, and may be pressed together.
//
// A pair at rest in contact under attraction would collide without end. It is held instead: a reaction λ ≥ 0 along the
// normal keeps the pair from approaching and does no work; where the pair is drawn apart λ is zero and the pair leaves.
// For accelerations, velocities and mean velocities alike this is a linear complementarity problem,
//   w_lo += λ n/m_lo, w_hi −= λ n/m_hi,   λ ≥ 0,   n·(w_lo − w_hi) ≥ bound,   one of the two with equality,
// solved by projected Gauss–Seidel (Moreau, 1988; Jean, Comput. Methods Appl. Mech. Eng. 177 (1999) 235).

#include <span>
#include <vector>

#include "engine/base/contact_log.h"

namespace carom {

/// Normal speeds below this share of the system's speeds are rounding: such a contact rests.
inline constexpr double kRestingSpeed = 1e-12;

template <int D>
struct RestingContact {
  EventKey<D> key;    ///< of the pair, or of the sphere and the wall
  Vec<D> normal;      ///< gradient of the gap up to a positive factor, acting on lo and, negated, on hi
  double bound = 0;   ///< see above
  double lambda = 0;  ///< the reaction found
};

/// Finds the reactions and adds their effect to w. The lambdas found before are the starting point.
template <int D>
void press_apart(std::span<RestingContact<D>> contacts, const std::vector<double>& mass, std::span<Vec<D>> w);

}  // namespace carom
