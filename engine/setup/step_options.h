// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The parameters of steps of the pair energy (laws/steps.h), as decks and Python give them.

#include <span>
#include <string>

#include "engine/base/parameters.h"
#include "engine/laws/box.h"
#include "engine/laws/interaction.h"

namespace carom {

const std::vector<Parameter>& step_parameters();

/// Gives pairs these steps: all pairs of two species, or listed pairs of a system with this many particles. With
/// `within` no pair gets steps until find_step_bonds() has listed them. These parameters are complete. Steps of two
/// species replace earlier ones of these two. Throws Error(Failure::deck), also if a pair is bonded twice.
template <int D>
void add_step(Box<D>& box, std::span<const std::string> species, std::size_t particles, const Parameters& given);

/// Replaces `within` by `pairs`: the ones that are at most this far apart in the positions of the context. Throws
/// Error(Failure::deck) if there are none.
template <int D>
void find_step_bonds(Parameters& given, const InteractionContext<D>& context);

}  // namespace carom
