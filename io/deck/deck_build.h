// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The parts of build_system(): from the words of a deck to particles, box and interactions.

#include "io/deck/deck_source.h"

namespace carom {

/// Boundaries, edges (1 where the deck leaves them to the packing fraction) and the names of species.
template <int D>
void fill_box(const Deck::Source& source, System<D>& system);

/// Masses, radii and charges; of this rank's block, where there are `ranks` and built_in_blocks().
template <int D>
void fill_particles(const Deck::Source& source, System<D>& system, Communicator* ranks);

/// Whether ranks can build their blocks of the initial state, each for itself: lattices of species with particles all
/// alike.
bool built_in_blocks(const Deck::Source& source);

/// Positions as [placement] says, for species given by count. Sets the box where the packing fraction does so.
template <int D>
void place_particles(const Deck::Source& source, System<D>& system);

/// The rows of a table of numbers: `columns` a line, separated by commas or blanks; # begins a comment, and the first
/// line may be a heading. Throws Error(Failure::deck), which says that a line is `not_what` it should be.
std::vector<std::vector<double>> rows_in(const std::string& text, const std::filesystem::path& file,
                                         std::size_t columns, const std::string& not_what);

}  // namespace carom
