// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// How much memory a deck needs, and how much is available: a run that needs too much ends before it allocates.

#include "engine/laws/box.h"
#include "io/deck/deck_source.h"

namespace carom {

/// Rough estimate of the bytes that a run of this deck needs on all ranks together, measured with the decks in inputs/.
/// Lists of pairs are included if the box is known, and count 0 otherwise.
template <int D>
double estimated_memory(const Deck::Source& source, const Box<D>* box);

/// Bytes that this process can still allocate.
double available_memory();

/// Throws Error(Failure::initial_state), with the estimate, if a rank's share exceeds the available memory.
template <int D>
void check_memory(const Deck::Source& source, const Box<D>* box, int ranks);

}  // namespace carom
