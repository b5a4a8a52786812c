// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A deck as TOML: the file parsed, `--set` values put in, and the place of every node known for messages.

#include <toml++/toml.h>

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>

#include "io/deck/deck_problems.h"

namespace carom {

struct DeckToml {
  std::string file;  ///< as the user wrote it
  toml::table root;
  std::unordered_map<const toml::node*, std::string> set;  ///< what came by `--set`, with the key it came by

  Place place(const toml::node& node) const;
  /// Of the key that names `node`.
  Place place(const toml::key& key, const toml::node& node) const;
};

/// Parses the text of a deck. Throws Error(Failure::deck) for malformed TOML; what is wrong with the overrides
/// (`table.key=value`, `list.0.key=value`) goes to `problems`.
DeckToml parse_deck(const std::filesystem::path& file, std::string_view text, std::span<const std::string> overrides,
                    Problems& problems);

/// Where an override gives a table another type, takes the keys out that this does not know and no override gives.
void drop_replaced(DeckToml& deck);

}  // namespace carom
