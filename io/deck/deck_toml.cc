// SPDX-License-Identifier: BSD-3-Clause
#include "io/deck/deck_toml.h"

#include <algorithm>
#include <charconv>

#include "io/deck/schema.h"

namespace carom {
namespace {

/// The value of an override: TOML, or a bare word, which stands for itself.
toml::table parse_value(const std::string& text) {
  const auto bare = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || std::string_view("_-+./").find(c) != std::string_view::npos;
  };
  try {
    return toml::parse("value = " + text);
  } catch (const toml::parse_error&) {
    if (text.empty() || !std::all_of(text.begin(), text.end(), bare)) throw;
    toml::table table;
    table.insert("value", text);
    return table;
  }
}

void label(DeckToml& deck, const toml::node& node, const std::string& key) {
  deck.set[&node] = key;
  if (const auto* array = node.as_array())
    for (const toml::node& item : *array) label(deck, item, key);
  if (const auto* table = node.as_table())
    for (const auto& [name, item] : *table) label(deck, item, key);
}

std::vector<std::string> split(const std::string& path) {
  std::vector<std::string> parts(1);
  for (const char c : path) {
    if (c == '.')
      parts.emplace_back();
    else if (c != ' ')
      parts.back() += c;
  }
  return parts;
}

/// The table that a step along the path leads to; makes missing tables; null where the path leads nowhere.
/// `next` moves on where a list's index is used up.
toml::table* descend(DeckToml& deck, toml::table& from, const std::vector<std::string>& parts, std::size_t& next,
                     const std::string& path) {
  const std::string& name = parts[next++];
  toml::node* child = from.get(name);
  if (child == nullptr) {
    from.insert(name, toml::table{});
    child = from.get(name);
    deck.set[child] = path;
  }
  toml::array* list = child->as_array();
  if (list == nullptr) return child->as_table();
  std::size_t index = 0;
  const std::string& part = parts[next];
  const auto [end, failed] = std::from_chars(part.data(), part.data() + part.size(), index);
  if (failed == std::errc{} && end == part.data() + part.size())
    ++next;
  else if (list->size() != 1)
    return nullptr;
  return index < list->size() && next < parts.size() ? list->get(index)->as_table() : nullptr;
}

void apply(DeckToml& deck, const std::string& text, Problems& problems) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) {
    problems.error({"--set " + text}, "no value", "write --set table.key=value");
    return;
  }
  const std::string path = text.substr(0, equals);
  const auto parts = split(path);
  toml::table* table = &deck.root;
  std::size_t next = 0;
  while (table != nullptr && next + 1 < parts.size()) table = descend(deck, *table, parts, next, path);
  if (table == nullptr) {
    problems.error({"--set " + path}, "there is no such table",
                   "count the tables of a list from 0, for instance particles.0.radius");
    return;
  }
  try {
    toml::table value = parse_value(text.substr(equals + 1));
    value.get("value")->visit([&](auto& node) { table->insert_or_assign(parts.back(), std::move(node)); });
    label(deck, *table->get(parts.back()), path);
  } catch (const toml::parse_error& e) {
    problems.error({"--set " + path}, "cannot read the value: " + std::string(e.description()),
                   "write it as in a deck: numbers plain, texts in quotes, lists in brackets");
  }
}

}  // namespace

Place DeckToml::place(const toml::node& node) const {
  if (const auto at = set.find(&node); at != set.end()) return {"--set " + at->second};
  return {file, static_cast<int>(node.source().begin.line), static_cast<int>(node.source().begin.column)};
}

Place DeckToml::place(const toml::key& key, const toml::node& node) const {
  if (set.contains(&node)) return place(node);
  return {file, static_cast<int>(key.source().begin.line), static_cast<int>(key.source().begin.column)};
}

DeckToml parse_deck(const std::filesystem::path& file, std::string_view text, std::span<const std::string> overrides,
                    Problems& problems) {
  DeckToml deck;
  deck.file = file.string();
  try {
    deck.root = toml::parse(text);
  } catch (const toml::parse_error& e) {
    const auto& at = e.source().begin;
    problems.error({deck.file, static_cast<int>(at.line), static_cast<int>(at.column)},
                   "not valid TOML: " + std::string(e.description()), "correct the syntax here or just before");
    problems.throw_errors(Failure::deck);
  }
  for (const std::string& override_text : overrides) apply(deck, override_text, problems);
  return deck;
}

void drop_replaced(DeckToml& deck) {
  const auto drop = [&](toml::node& node, const TableSchema& schema) {
    toml::table* const table = node.as_table();
    const toml::node* const type = table != nullptr ? table->get("type") : nullptr;
    if (type == nullptr || !type->is_string() || !deck.set.contains(type)) return;
    const Variant* const chosen = schema.variant(type->as_string()->get());
    if (chosen == nullptr) return;
    std::vector<std::string> foreign;
    for (const auto& [key, value] : *table) {
      const auto is_it = [name = key.str()](const Key& known) { return known.name == name; };
      if (!deck.set.contains(&value) && std::ranges::none_of(schema.keys, is_it) &&
          std::ranges::none_of(chosen->keys, is_it))
        foreign.emplace_back(key.str());
    }
    for (const std::string& key : foreign) table->erase(key);
  };
  for (const TableSchema& schema : deck_schema()) {
    toml::node* const node = schema.name.empty() ? nullptr : deck.root.get(schema.name);
    if (node == nullptr || schema.variants.empty()) continue;
    if (toml::array* const list = node->as_array())
      for (toml::node& item : *list) drop(item, schema);
    else
      drop(*node, schema);
  }
}

}  // namespace carom
