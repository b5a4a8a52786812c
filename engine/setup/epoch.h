// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The default length of an epoch of free flight.

#include "engine/ranks/system.h"

namespace carom {

/// Forty mean free times of the fluid at this density (Enskog's theory), but at most the time to move 300 diameters or
/// to cross the box four times, and less if light or fast particles could cross more boxes than can be counted; rounded
/// to two digits; 1 if nothing moves. Longer epochs lose digits, because times and unwrapped positions grow.
template <int D>
double default_epoch(const System<D>& system);

}  // namespace carom
