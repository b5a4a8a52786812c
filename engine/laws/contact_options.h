// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The parameters of the law of a contact, as decks and Python give them.

#include <span>
#include <string>

#include "engine/base/parameters.h"
#include "engine/laws/box.h"

namespace carom {

const std::vector<Parameter>& contact_parameters();

/// Sets the law of all contacts between two partners; the box must have its walls. These parameters are complete; a
/// later law replaces an earlier one of the same partners. Throws Error(Failure::deck).
template <int D>
void add_contact(Box<D>& box, std::span<const std::string> species, const Parameters& given);

/// Throws Error(Failure::deck) unless a body may have this reduced moment of inertia.
void check_inertia(double inertia, int dimension);

}  // namespace carom
