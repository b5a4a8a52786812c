// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The energy of the steps of a state, counted from positions: the check of the energy that events have stored.

#include "engine/base/exact_sum.h"
#include "engine/base/particles.h"
#include "engine/ranks/system.h"

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

/// What this rank's pairs contribute; `state`: positions and velocities of this rank's particles. Collective.
template <int D>
StepAccount own_steps(const System<D>& system, const Particles<D>& state);

}  // namespace carom
