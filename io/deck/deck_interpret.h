// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// From the values of a deck to what they mean together: lengths of lists, ids that exist, tables that need each other.

#include "io/deck/deck_source.h"

namespace carom {

/// Fills everything of `deck` but toml_text. What is wrong goes to `problems`; then the deck is of no use.
void interpret(DeckValues values, Deck& deck, Problems& problems);

/// Declared parameters from a table, for the code that declared them.
Parameters parameters_of(const ValueTable& table);

}  // namespace carom
