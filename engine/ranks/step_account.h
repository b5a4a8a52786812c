// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The energy of the steps of a state, counted from positions: the check of the energy that events have stored.

#include "engine/base/exact_sum.h"
#include "engine/base/particles.h"
#include "engine/ranks/system.h"
#include "engine/search/neighbour_list.h"

namespace carom {

struct StepAccount {
  ExactSum energy{};           ///< Σ u over pairs [energy]
  std::uint64_t inside = 0;    ///< pairs inside the outermost of their steps
  std::uint64_t tethered = 0;  ///< pairs inside a tether

  void add(const StepAccount& other) {
    energy.add(other.energy);
    inside += other.inside;
    tethered += other.tethered;
  }
};

/// What this rank's pairs contribute; `state`: positions and velocities of this rank's particles. `near`: pairs within
/// reach, from an earlier call; null: they are searched for. Collective.
template <int D>
StepAccount own_steps(const System<D>& system, const Particles<D>& state, NeighbourList<D>* near = nullptr);

/// The list for own_steps().
template <int D>
NeighbourList<D> step_pairs(const System<D>& system, const Particles<D>& state) {
  return NeighbourList<D>(system.box, system.box.steps.reach()(state.radius), state.ghost, state.all_fixed());
}

}  // namespace carom
