// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Is the initial state possible, and is the run on it sensible?

#include "io/deck/deck_source.h"

namespace carom {

/// Overlapping spheres, spheres outside the walls, a box too small or too full. Points (integrators without hard cores)
/// may stand anywhere.
template <int D>
void check_state(const Deck& deck, const System<D>& system, Problems& problems);

/// A step too long for the forces, cutoffs beyond half the box, more than close packing, walls that do nothing.
template <int D>
void warn_of_state(const Deck& deck, System<D>& system, Problems& problems);

/// The shortest period of small vibrations about the present positions, 2π/√|λ| with λ the eigenvalue of M⁻¹V″ that is
/// largest in magnitude (power iteration; for one harmonic bond 2π/√(k(1/m + 1/m'))). Infinite without forces. Of what
/// all ranks know together, where the system is what one of them knows (engine/ranks/decomposition.h). Collective.
template <int D>
double shortest_period(const System<D>& system);

}  // namespace carom
