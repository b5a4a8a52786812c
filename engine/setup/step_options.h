// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The parameters of steps of the pair energy (laws/steps.h), as decks and Python give them.

#include <span>
#include <string>

#include "engine/base/parameters.h"
#include "engine/laws/box.h"

namespace carom {

const std::vector<Parameter>& step_parameters();

/// Gives pairs these steps: all pairs of two species, or listed pairs of a system with this many particles. These
/// parameters are complete. Steps of two species replace earlier ones of these two. Throws Error(Failure::deck), also
/// if a pair is bonded twice.
template <int D>
void add_step(Box<D>& box, std::span<const std::string> species, std::size_t particles, const Parameters& given);

}  // namespace carom
