// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The declared schema of a deck: every table and every key with type, unit, range, default and meaning, once.
//
// Reading and checking, `carom schema`, and the resolved deck are all made from it. The keys of integrators,
// interactions and observables come from their own declarations (engine/integrators/integrator.h, interaction.h,
// observable.h).

#include <array>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "engine/run/observable.h"

namespace carom {

/// One key of a table.
struct Key {
  enum class Type {  // first those of Parameter, in its order
    boolean,
    integer,  ///< a real number without a fraction (1e6) will do
    real,     ///< an integer will do
    real_list,
    text,
    text_list,
    pair_list,
    vector_list,   ///< one vector of system.dimension numbers for each particle
    real_or_list,  ///< one number for all, or one for each particle
    text_table,    ///< an inline table of texts: `keys`
  };
  static_assert(static_cast<int>(Type::pair_list) == static_cast<int>(Parameter::Type::pair_list));
  std::string name;
  Type type = Type::real;
  std::string fallback;  ///< the default as TOML text; "" = must be given; "none" = may be left out
  std::string unit;
  std::string meaning;
  Parameter::Range range = Parameter::Range::any;
  std::vector<std::string> choices{};
  std::vector<std::array<std::string_view, 2>> former{};  ///< as in Parameter
  double most = std::numeric_limits<double>::infinity();  ///< as in Parameter
  std::vector<Key> keys{};                                ///< of a text_table, each of them needed

  bool required() const { return fallback.empty(); }
  bool has_default() const { return !required() && fallback != "none"; }
};

/// What `type = "…"` of a table may be, with the keys it brings along.
struct Variant {
  std::string name;
  std::vector<Key> keys;
};

/// One table of the deck.
struct TableSchema {
  std::string name;       ///< "" = the keys at the top
  bool list = false;      ///< [[name]]: any number of times
  bool required = false;  ///< must stand there (a list: at least once)
  std::string meaning;
  std::vector<Key> keys;
  std::vector<Variant> variants{};  ///< non-empty: `type` chooses one of them
  std::vector<std::array<std::string_view, 2>>
      former{};  ///< types and keys that are no more, and what to write instead

  const Variant* variant(std::string_view type) const;
};

/// All tables, in the order of the manual and of the resolved deck.
const std::vector<TableSchema>& deck_schema();
const TableSchema& table_schema(std::string_view name);

/// The key in [output] of a parameter of an observable.
std::string output_key(const ObservableInfo& info, std::string_view parameter);

/// "positive real" and the like, for messages and pages.
std::string type_name(const Key& key);

/// The schema as a page: plain text for a terminal, or Markdown for the manual.
std::string schema_page(bool markdown);

/// Every integrator with order, conserved quantities, parameters and source, and every observable with its own.
std::string methods_page();

}  // namespace carom
