// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Checks that the initial state is possible and that the run from it makes sense.

#include "io/deck/deck_source.h"

namespace carom {

/// The place in the deck that gives the position of this particle.
const Place& place_of(const Deck::Source& source, Id id);

/// Overlapping spheres, spheres outside the walls, a box too small or too full. Points (integrators without hard cores)
/// may be anywhere. A bath that cannot heat; if the deck has given the positions (`fresh`), bonds that are too long.
template <int D>
void check_state(const Deck& deck, const System<D>& system, Problems& problems, bool fresh);

/// A step too long for the forces, cutoffs beyond half the box, more than close packing, walls that do nothing.
template <int D>
void warn_of_state(const Deck& deck, System<D>& system, Problems& problems);

/// The shortest period of small vibrations about the present positions, 2π/√|λ| with λ the eigenvalue of M⁻¹V″ that is
/// largest in magnitude (power iteration; for one harmonic bond 2π/√(k(1/m + 1/m'))). Infinite without forces. If the
/// system is distributed over ranks (engine/ranks/decomposition.h), this is the period of the whole system. Collective.
template <int D>
double shortest_period(const System<D>& system);

}  // namespace carom
