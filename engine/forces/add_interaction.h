// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Adds terms of V, by name or from a user's declaration.

#include <string_view>

#include "engine/ranks/system.h"

namespace carom {

/// Adds the term with this name in decks; parameters not given get their defaults. Throws Error(Failure::deck). Add
/// particles first, and bonds before terms that exclude bonded pairs.
template <int D>
void add_interaction(System<D>& system, std::string_view type, Parameters given);
/// Adds a term of a user-defined type (engine/examples/own_potential.cc).
template <int D>
void add_interaction(System<D>& system, const InteractionInfo& info, Parameters given);

}  // namespace carom
