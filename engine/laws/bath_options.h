// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The parameters of a bath, as decks and Python give them.

#include "engine/base/parameters.h"
#include "engine/laws/bath.h"

namespace carom {

const std::vector<Parameter>& bath_parameters();

/// The bath with these parameters, which are complete; `seed` is used if they have none. Throws Error(Failure::deck).
Bath bath_of(const Parameters& given, std::uint64_t seed = 1);

}  // namespace carom
