// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Terms of V by their names, or by a declaration of one's own.

#include <string_view>

#include "engine/ranks/system.h"

namespace carom {

/// Adds a term to V by its name in the deck, with defaults for the parameters that are not given. Throws
/// Error(Failure::deck). Particles must be there, and bonds before terms that exclude bonded pairs.
template <int D>
void add_interaction(System<D>& system, std::string_view type, Parameters given);
/// The same of a type that only this program has (engine/examples/own_potential.cc).
template <int D>
void add_interaction(System<D>& system, const InteractionInfo& info, Parameters given);

}  // namespace carom
