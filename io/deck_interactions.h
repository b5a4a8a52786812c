#pragma once
// The [[interaction]] tables, and the interactions made from them.

#include "io/deck_source.h"

namespace carom {

/// Fills source.interactions from its values and tries to make each, so that what an interaction itself refuses is told
/// together with everything else. The dimension is 0 where it is not known.
void read_interactions(Deck::Source& source, std::size_t dimension, Problems& problems);

/// Makes every interaction and tries whether the integrator can carry it; `skip[n]` leaves out the n-th, `placed`
/// tells whether the positions are known. What an interaction refuses goes to `problems` with its place.
template <int D>
void make_interactions(const Deck::Source& source, const std::vector<bool>& skip, System<D>& system, bool placed,
                       Problems& problems);

}  // namespace carom
