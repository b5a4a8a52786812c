// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// How long an epoch of free flight is where nothing else is said.

#include "engine/ranks/system.h"

namespace carom {

/// Forty mean free times of the fluid that the state would be (Enskog's theory), at most the time to fly 300
/// diameters or to cross the box four times, and less where light or fast particles would cross more boxes than can be
/// counted; rounded to two digits; 1 if nothing moves. Longer epochs cost digits: times and unwrapped positions grow in
/// them.
template <int D>
double default_epoch(const System<D>& system);

}  // namespace carom
