// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A deck's values, each checked against its own declaration in the schema and completed by defaults: types, ranges,
// choices, unknown and missing keys. What keys mean together is checked later (io/deck/deck_interpret.h).

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "io/deck/deck_problems.h"
#include "io/deck/schema.h"

namespace carom {

struct DeckToml;

using Value = std::variant<bool, std::int64_t, double, std::vector<double>, std::string, std::vector<std::string>,
                           PairList, std::vector<std::vector<double>>, std::map<std::string, std::string>>;

/// One table of the deck, read.
struct ValueTable {
  const TableSchema* schema = nullptr;
  const Variant* variant = nullptr;  ///< chosen by `type`
  Place at;                          ///< of its head
  std::map<std::string, Value, std::less<>> values;
  std::map<std::string, Place, std::less<>> places;  ///< of the keys that the deck gives

  /// The value, or null where the key was not given and has no default, or was wrong and is reported.
  template <class T>
  const T* find(std::string_view key) const {
    const auto it = values.find(key);
    return it == values.end() ? nullptr : std::get_if<T>(&it->second);
  }
  bool given(std::string_view key) const { return places.find(key) != places.end(); }
  /// Of the key, or of the table where the deck doesn't give it.
  const Place& place(std::string_view key) const {
    const auto it = places.find(key);
    return it == places.end() ? at : it->second;
  }
  /// Calls visit(key) for the keys of the table and of its variant, in the order of the schema.
  template <class Visit>
  void each_key(Visit&& visit) const {
    for (const Key& key : schema->keys) visit(key);
    if (variant != nullptr)
      for (const Key& key : variant->keys) visit(key);
  }
};

/// All tables, by name, in the order of the deck. [output] is always there.
struct DeckValues {
  std::string file;
  std::map<std::string, std::vector<ValueTable>, std::less<>> tables;

  std::vector<ValueTable>& list(std::string_view name);
  const std::vector<ValueTable>& list(std::string_view name) const;
  /// The one table of that name, or null.
  ValueTable* find(std::string_view name);
  const ValueTable* find(std::string_view name) const;
};

DeckValues read_values(const DeckToml& deck, Problems& problems);

/// The values as a deck again, in the order of the schema; numbers in the fewest digits that give them back exactly.
std::string write_deck(const DeckValues& values);

}  // namespace carom
