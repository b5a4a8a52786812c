// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The [[interaction]] tables, and the interactions made from them.

#include "io/deck/deck_source.h"

namespace carom {

/// Puts the points of tables that are given as files in the place of `file`, and their last point where there is no
/// cutoff: the values say them themselves from now on. Throws Error(Failure::file), or Failure::deck for what is wrong
/// in a file.
void read_potentials(DeckValues& values, const std::filesystem::path& folder, const TextReader& reader,
                     Problems& problems);

/// Fills source.interactions from its values and tries to make each, so that what an interaction itself refuses is
/// reported together with everything else. The dimension is 0 where it is not known.
void read_interactions(Deck::Source& source, std::size_t dimension, Problems& problems);

/// Makes every interaction and tries whether the integrator can carry it; `skip[n]` leaves out the n-th, `placed` is
/// whether the positions are known. What an interaction refuses goes to `problems` with its place.
template <int D>
void make_interactions(const Deck::Source& source, const std::vector<bool>& skip, System<D>& system, bool placed,
                       Problems& problems);

}  // namespace carom
