// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Resting contacts: pairs that touch, have no normal velocity, and may be pressed together by forces.
//
// A pair at rest in contact that forces press together would collide without end. Instead a reaction λ ≥ 0 along the
// normal keeps the pair from approaching and does no work; where forces pull the pair apart, λ is zero and the pair
// separates. For accelerations, velocities and mean velocities this is the same linear complementarity problem,
//   w_lo += λ n/m_lo, w_hi −= λ n/m_hi,   λ ≥ 0,   n·(w_lo − w_hi) ≥ bound,   one of the two with equality.
//
// Contacts that share no sphere are independent, so each cluster of contacts is solved by itself: block
// principal pivoting on the set of contacts with a reaction (Júdice, Pires, Comput. Oper. Res. 21 (1994) 587), with a
// sparse LDLᵀ factorisation for each set. In a statically indeterminate cluster (a crystal) the reactions are not
// unique, though the motion is; there the matrix is singular. The proximal point method (Rockafellar, SIAM J. Control
// Optim. 14 (1976) 877) adds a small diagonal to it and removes the effect on the motion by repetition.

#include <memory>
#include <span>
#include <vector>

#include "engine/laws/contact_log.h"

namespace carom {

/// Normal speeds below this fraction of the speeds of two spheres, or of the speeds that each force and reaction on
/// them would give them within the step, count as rounding: 10⁴ times the rounding of one number.
inline constexpr double kRounding = 1e-12;

/// A contact counts as closed if, before forces close it again, it opens by no more than kRestingGap contact distances
/// (the overlap that spheres may have), and if it would do so more than kMostBounces times a step.
inline constexpr double kRestingGap = 1e-12;
inline constexpr int kMostBounces = 64;

/// A contact with a law that names no rest speed rests below the speed of a fall from this many contact distances: a
/// pile then settles with bounces that no picture of it would show, the last ones 1e-4 radii high.
inline constexpr double kRestHeight = 0.5e-4;

template <int D>
struct RestingContact {
  EventKey<D> key;    ///< names the pair, or the sphere and the wall
  Vec<D> normal;      ///< gradient of the gap up to a positive factor, acting on lo and, negated, on hi
  double bound = 0;   ///< see above
  double slack = 0;   ///< by how much n·(w_lo − w_hi) may miss the bound before known reactions are solved again
  double lambda = 0;  ///< the reaction found
  double force = 0;   ///< the force of this reaction in the last piece with the contact held [force]
};

/// Finds reactions. It keeps the factors of the last solution, which serve again as long as the contacts are the same
/// and their normals have hardly changed; so the last bits of a result depend on what was solved since forget().
template <int D>
class ReactionSolver {
 public:
  ReactionSolver();
  ~ReactionSolver();
  void forget();

  /// Finds the reactions and adds their effect to w. The iteration starts from the given lambdas; if they already solve
  /// the problem to rounding, they are left unchanged. The last bits of the result depend on the order of the contacts:
  /// sort them. `lost` receives the decrease of ½ Σ m w². Returns false if the problem was not solved to rounding.
  bool solve(std::span<RestingContact<D>> contacts, const std::vector<double>& mass, std::span<Vec<D>> w,
             double* lost = nullptr);

  class Problem;

 private:
  std::unique_ptr<Problem> problem_;
};

/// Finds reactions without keeping factors.
template <int D>
bool solve_reactions(std::span<RestingContact<D>> contacts, const std::vector<double>& mass, std::span<Vec<D>> w,
                     double* lost = nullptr) {
  return ReactionSolver<D>().solve(contacts, mass, w, lost);
}

/// Removes the normal velocity, of either sign, from contacts that stay closed. The tangential motion of each cluster
/// is rescaled so that its kinetic energy and its momentum along axes without walls are conserved. Returns the energy
/// that could not be given back in this way because there is hardly any tangential motion.
template <int D>
double keep_tangential(std::span<RestingContact<D>> contacts, const std::vector<double>& mass, std::span<Vec<D>> v);

}  // namespace carom
