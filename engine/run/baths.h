// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// What the bath of a system does at the end of a slab: `rescaling` acts there, and `andersen` in methods with steps. In
// free flight its kicks are events (engine/events/).

#include "engine/laws/counters.h"
#include "engine/ranks/system.h"

namespace carom {

/// Scales all velocities by the factor of Bussi and Parrinello, Comput. Phys. Commun. 179 (2008) 26, after a slab of
/// this length that ends at `time`: relative to the centre of mass if momentum is conserved. All ranks use the same
/// factor. Collective.
template <int D>
void rescale(System<D>& system, std::int64_t slab, double time, double length, Counters& counters);

/// Gives all particles the kicks of a step of this length from time `start`. Collective.
template <int D>
void kick_all(System<D>& system, double start, double length, Counters& counters);

}  // namespace carom
