// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The parameters of a wall, as decks and Python give them.

#include "engine/base/parameters.h"
#include "engine/laws/box.h"

namespace carom {

const std::vector<Parameter>& wall_parameters();

/// Adds a wall with these parameters, which are complete; `seed` is used if they have none. Throws
/// Error(Failure::deck).
template <int D>
void add_wall(Box<D>& box, const Parameters& given, std::uint64_t seed = 1);

/// A sphere or cylinder that is too small for this diameter, or two parallel walls that leave less room than it
/// between them now, for messages; empty if there are none. Walls with spheres behind them count for
/// a diameter of 0 only.
template <int D>
std::string no_room(const Box<D>& box, double diameter);

}  // namespace carom
