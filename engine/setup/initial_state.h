// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Checks of an initial state, on all ranks together.

#include "engine/ranks/system.h"
#include "engine/setup/placement.h"

namespace carom {

/// Pairs closer than their contact distance, and the ids of the pair that overlaps most, the first one in a tie. Does
/// not depend on the number of ranks; collective.
template <int D>
Overlaps find_overlaps(const System<D>& system);

/// Spheres that extend beyond a wall; `worst` is an id. Collective.
template <int D>
Outsiders find_outsiders(const System<D>& system);

/// Why the steps of pairs do not fit radii, box or positions, as "what is wrong; what to do"; empty if they do.
/// Collective.
template <int D>
std::string step_problem(const System<D>& system);

}  // namespace carom
