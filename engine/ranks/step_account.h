// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The energy of the steps of a state, counted from positions: the check of the energy that events have stored.

#include <string>

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
  /// Throws Error(Failure::numerical) if the energy is not the one that events have stored, so that a pair has changed
  /// sides unseen (step_event.h), or if a tether has lost a pair. `when`: for the message.
  void check(const Steps& steps, double by_events, const std::string& when) const;
};

/// What this rank's pairs contribute; `state`: positions and velocities of this rank's particles. `near`: a list of the
/// pairs that may have steps between them, or null. Collective if pairs have steps.
template <int D>
StepAccount own_steps(const System<D>& system, const Particles<D>& state, NeighbourList<D>* near = nullptr);

/// The energy of the steps of each particle: half of that of each of its pairs, by id, on the first rank; empty on
/// others, and without steps. The bits are the same on any number of ranks. Collective if pairs have steps.
template <int D>
std::vector<double> step_energies(const System<D>& system, const Particles<D>& state);

}  // namespace carom
