// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// How much memory a deck will take, and how much there is: a run that cannot have what it needs ends before it takes
// it.

#include "engine/base/box.h"
#include "io/deck/deck_source.h"

namespace carom {

/// Bytes that a run of this deck takes on all ranks together, roughly, as measured with the decks in inputs/. Lists of
/// pairs count where the box is known already, else null.
template <int D>
double estimated_memory(const Deck::Source& source, const Box<D>* box);

/// Bytes that this process can still get.
double available_memory();

/// Throws Error(Failure::initial_state), which says the estimate, where a rank's share is more than there is.
template <int D>
void check_memory(const Deck::Source& source, const Box<D>* box, int ranks);

}  // namespace carom
