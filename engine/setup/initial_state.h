// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Whether an initial state is possible, looked at on all ranks together.

#include "engine/ranks/system.h"
#include "engine/setup/placement.h"

namespace carom {

/// Pairs of the system closer than their contact distance; ids of the pair that overlaps most, the lowest among equals.
/// The same on any number of ranks; collective.
template <int D>
Overlaps find_overlaps(const System<D>& system);

/// Spheres of the system that reach through a wall; `worst`: its id. Collective.
template <int D>
Outsiders find_outsiders(const System<D>& system);

}  // namespace carom
