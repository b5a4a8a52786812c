// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Resting contacts: pairs that touch, have no normal velocity, and may be pressed together.
//
// A pair at rest in contact that something presses would collide without end. It is held instead: a reaction λ ≥ 0
// along the normal keeps the pair from approaching and does no work; where the pair is drawn apart λ is zero and the
// pair leaves. For accelerations, velocities and mean velocities alike this is a linear complementarity problem,
//   w_lo += λ n/m_lo, w_hi −= λ n/m_hi,   λ ≥ 0,   n·(w_lo − w_hi) ≥ bound,   one of the two with equality.
//
// Contacts that share no sphere do not feel each other, so each cluster of contacts is solved by itself: block
// principal pivoting on the set of contacts with a reaction (Júdice, Pires, Comput. Oper. Res. 21 (1994) 587), with a
// sparse LDLᵀ factorisation for each set. In a statically indeterminate cluster (a crystal) the reactions are not
// unique, though the motion is; there the matrix is singular. The proximal point method (Rockafellar, SIAM J. Control
// Optim. 14 (1976) 877) adds a small diagonal to it and removes the effect on the motion by repetition.

#include <span>
#include <vector>

#include "engine/base/contact_log.h"

namespace carom {

/// Normal speeds below this share of the speeds that two spheres have, or that the forces and reactions on them would
/// give them one by one within the step, are rounding: four digits above that of one number.
inline constexpr double kRounding = 1e-12;

/// A contact that opens by no more than this share of the contact distance, which is what spheres may overlap by, until
/// what presses it closes it again, and would do so more than this number of times a step, is closed.
inline constexpr double kRestingGap = 1e-12;
inline constexpr int kMostBounces = 64;

template <int D>
struct RestingContact {
  EventKey<D> key;    ///< of the pair, or of the sphere and the wall
  Vec<D> normal;      ///< gradient of the gap up to a positive factor, acting on lo and, negated, on hi
  double bound = 0;   ///< see above
  double slack = 0;   ///< by how much n·(w_lo − w_hi) may miss the bound with the reactions that are known
  double lambda = 0;  ///< the reaction found
  double force = 0;   ///< the force that it stands for, of the last piece that was held [force]
};

/// Finds the reactions and adds their effect to w. The lambdas given are the starting point: where they solve the
/// problem to rounding already they stay as they are. The last bits of the result depend on the order of the contacts:
/// sort them. `lost`: gets ½ Σ m w² before less that after. False: not solved to rounding.
template <int D>
bool solve_reactions(std::span<RestingContact<D>> contacts, const std::vector<double>& mass, std::span<Vec<D>> w,
                     double* lost = nullptr);

/// Takes the normal velocity out of contacts that stay closed, in both directions. The tangential motion of each
/// cluster is stretched so that its kinetic energy and its momentum along axes without walls stay; returns the energy
/// that could not be given back in this way, because there is hardly any tangential motion.
template <int D>
double keep_tangential(std::span<RestingContact<D>> contacts, const std::vector<double>& mass, std::span<Vec<D>> v);

}  // namespace carom
