// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// What the bath of a system does at the end of a slab: `rescaling` and `langevin` act there, and `andersen` in
// methods with steps. In free flight the kicks of `andersen` are events (engine/events/).

#include "engine/laws/counters.h"
#include "engine/ranks/system.h"

namespace carom {

/// Scales all velocities by the factor of Bussi and Parrinello, Comput. Phys. Commun. 179 (2008) 26, after a slab of
/// this length that ends at `time`: relative to the centre of mass if momentum is conserved. All ranks use the same
/// factor. Collective.
template <int D>
void rescale(System<D>& system, std::int64_t slab, double time, double length, Counters& counters);

/// Damps all velocities by friction and adds noise, after a slab of this length that ends at `time`: v becomes c v +
/// √(1 − c²) w with c = exp(−γ length) and w drawn from the distribution of Maxwell and Boltzmann, which is the exact
/// solution of dv = −γ v dt + √(2 γ kT/m) dW (Ornstein, Uhlenbeck, Phys. Rev. 36 (1930) 823). Collective.
template <int D>
void damp(System<D>& system, double time, double length, Counters& counters);

/// Gives all particles the kicks of a step of this length from time `start`. Collective.
template <int D>
void kick_all(System<D>& system, double start, double length, Counters& counters);

}  // namespace carom
