// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A deck's values, each checked against its own declaration in the schema and completed by defaults: types, ranges,
// choices, unknown and missing keys. Values are checked against each other later (deck_interpret.cc).

#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "io/deck/deck_problems.h"
#include "io/deck/schema.h"

namespace carom {

/// Limits of numbers that have a unit, other than 0: products of four of them are neither infinite nor 0.
constexpr double kLargestNumber = 1e75, kSmallestNumber = 1e-75;
/// Why a number with a unit is refused, and what to do, in the form "is …; take …"; empty if it is within the limits.
/// The components of vectors may be small.
std::string beyond_limits(double number, bool component = true);

/// One table of the deck, read.
struct ValueTable {
  const TableSchema* schema = nullptr;
  const Variant* variant = nullptr;  ///< chosen by `type`
  Place at;                          ///< the place of its head
  Parameters values;
  std::map<std::string, Place, std::less<>> places;  ///< places of the keys that the deck gives
  bool wrong = false;                                ///< a problem in it has been reported

  /// The value, or null if the key is missing and has no default, or was reported as wrong.
  template <class T>
  const T* find(std::string_view key) const {
    return values.find<T>(key);
  }
  /// Copies the value, if there is one.
  template <class T>
  void read(std::string_view key, auto& to) const {
    if (const T* value = find<T>(key)) to = *value;
  }
  bool given(std::string_view key) const { return places.find(key) != places.end(); }
  /// The place of the key, or of the table if the deck does not give the key.
  const Place& place(std::string_view key) const {
    const auto it = places.find(key);
    return it == places.end() ? at : it->second;
  }
  /// Calls visit(key) for the keys of the table and of its variant, in the order of the schema.
  template <class Visit>
  void each_key(Visit&& visit) const {
    for (const Parameter& key : schema->keys) visit(key);
    if (variant != nullptr)
      for (const Parameter& key : variant->keys) visit(key);
  }
  /// The values of the variant's own keys, for the code that declared them.
  Parameters of_variant() const;
};

/// All tables, by name, in the order of the deck. [output] is always there.
struct DeckValues {
  std::string file;
  std::map<std::string, std::vector<ValueTable>, std::less<>> tables;

  std::vector<ValueTable>& list(std::string_view name) { return tables.find(name)->second; }
  const std::vector<ValueTable>& list(std::string_view name) const { return tables.find(name)->second; }
  /// The first table of that name, or null.
  ValueTable* find(std::string_view name) { return list(name).empty() ? nullptr : &list(name).front(); }
  const ValueTable* find(std::string_view name) const { return list(name).empty() ? nullptr : &list(name).front(); }
};

/// The values of a deck from its text and the overrides (`table.key=value`, `list.0.key=value`). `replace`: if an
/// override changes the type of a table, keys that the new type does not know are dropped instead of being errors.
/// Throws Error(Failure::deck) if the text is not TOML; all other errors go to `problems`.
DeckValues read_values(const std::filesystem::path& file, std::string_view text, std::span<const std::string> overrides,
                       bool replace, Problems& problems);

/// A table that a program makes, completed by defaults; if `type` chooses a variant, of the keys that it adds. Throws
/// Error(Failure::deck).
ValueTable table_of(std::string_view name, Parameters given);

/// The values as a deck again, in the order of the schema; numbers have the fewest digits that reproduce them exactly.
std::string write_deck(const DeckValues& values);

}  // namespace carom
