// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The declared schema of a deck: every table and every key with type, unit, range, default and meaning, once.
//
// Reading, checking, `carom schema` and the resolved deck all use it. The keys of integrators,
// interactions and observables come from their own declarations (engine/integrators/integrator.h, interaction.h,
// observable.h).

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "engine/run/observable.h"

namespace carom {

/// One value of `type = "…"` of a table, with the keys that it adds.
struct Variant {
  std::string name;
  std::vector<Parameter> keys;
};

/// One table of the deck.
struct TableSchema {
  std::string name;       ///< "" = the keys at the top
  bool list = false;      ///< [[name]]: any number of times
  bool required = false;  ///< must be given (a list: at least once)
  std::string meaning;
  std::vector<Parameter> keys;
  std::vector<Variant> variants{};                   ///< non-empty: `type` chooses one of them
  std::vector<std::array<std::string, 2>> former{};  ///< types and keys that were removed or belong to
                                                     ///< other variants, and what to write instead

  const Variant* variant(std::string_view type) const;
  /// "[name]" or "[[name]]"; "the deck" for the keys at the top.
  std::string heading() const;
};

/// All tables, in the order of the manual and of the resolved deck.
const std::vector<TableSchema>& deck_schema();
const TableSchema& table_schema(std::string_view name);

/// The key in [output] of a parameter of an observable.
std::string output_key(const ObservableInfo& info, std::string_view parameter);

/// "positive number" and similar names, for messages and pages.
std::string type_name(const Parameter& key);

/// The schema as a page: plain text for a terminal, or Markdown for the manual.
std::string schema_page(bool markdown);

/// Every integrator with order, conserved quantities, parameters and source, and every observable with its parameters.
std::string methods_page();

}  // namespace carom
