// SPDX-License-Identifier: BSD-3-Clause
#include "io/deck/deck_values.h"

#include <toml++/toml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <sstream>
#include <unordered_map>

namespace carom {
namespace {

/// A deck as TOML: the file parsed, `--set` values put in, and the place of every node for messages.
struct DeckToml {
  std::string file;  ///< as the user wrote it
  toml::table root;
  std::unordered_map<const toml::node*, std::string> set;  ///< nodes set by `--set`, with their keys

  Place place(const toml::node& node) const { return place(node.source(), node); }
  /// The place of the key that names `node`.
  Place place(const toml::key& key, const toml::node& node) const { return place(key.source(), node); }

 private:
  Place place(const toml::source_region& at, const toml::node& node) const {
    if (const auto known = set.find(&node); known != set.end()) return {"--set " + known->second};
    return {file, static_cast<int>(at.begin.line), static_cast<int>(at.begin.column)};
  }
};

/// The value of an override: TOML, or a bare word, which stands for itself.
toml::table parse_value(const std::string& text) {
  const auto bare = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || std::string_view("_-+./").find(c) != std::string_view::npos;
  };
  try {
    return toml::parse("value = " + text);
  } catch (const toml::parse_error&) {
    const bool too_large = text.find_first_not_of("+-0123456789_") == std::string::npos;  // an integer
    if (text.empty() || too_large || !std::all_of(text.begin(), text.end(), bare)) throw;
    toml::table table;
    table.insert("value", text);
    return table;
  }
}

/// Records that a value and everything in it were set by `--set`.
void label(DeckToml& deck, const toml::node& node, const std::string& key) {
  deck.set[&node] = key;
  if (const auto* array = node.as_array())
    for (const toml::node& item : *array) label(deck, item, key);
  if (const auto* table = node.as_table())
    for (const auto& [name, item] : *table) label(deck, item, key);
}

std::vector<std::string> split(std::string path) {
  std::erase(path, ' ');
  std::istringstream in(path + '.');
  std::vector<std::string> parts;
  for (std::string part; std::getline(in, part, '.');) parts.push_back(part);
  return parts;
}

/// The table that a step along the path leads to; makes missing tables; null if the path leads nowhere.
/// `next` advances if the step consumes the index of a list.
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

/// Applies an override to the deck.
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

/// Reads one node as the type that its key declares; reports an error at the innermost wrong node.
class NodeReader {
 public:
  NodeReader(const Parameter& key, const DeckToml& deck, Problems& problems)
      : key_(key), deck_(deck), problems_(problems) {}

  std::optional<ParameterValue> read(const toml::node& node) {
    const auto as_real = [this](const toml::node& n) { return read_real(n); };
    const auto as_text = [this](const toml::node& n) { return read_text(n); };
    using enum Parameter::Type;
    switch (key_.type) {
      case boolean:
        if (const auto* b = node.as_boolean()) return b->get();
        return wrong_type(node, "true or false");
      case integer:
        return read_integer(node);
      case real_or_list:
        if (node.is_array()) return read_list<double>(node, as_real);
        return read_real(node);
      case real:
        return read_real(node);
      case real_list:
        return read_list<double>(node, as_real);
      case text:
        return read_text(node);
      case text_list:
        return read_list<std::string>(node, as_text);
      case pair_list:
        return read_list<PairList::value_type>(node, [this](const toml::node& n) { return read_pair(n); });
      case vector_list:
        return read_list<std::vector<double>>(node, [&](const toml::node& n) { return read_list<double>(n, as_real); });
      case real_or_pairs:
        if (!node.is_array()) return read_real(node);
        return read_list<std::vector<double>>(node, [&](const toml::node& n) { return read_list<double>(n, as_real); });
      case table:
        return read_inline(node, "a table");
      case real_or_table:
        if (node.is_table()) return read_inline(node, "a number or a table");
        return read_real(node);
    }
    return {};
  }

 private:
  void complain(const toml::node& node, const std::string& what, const std::string& remedy) {
    problems_.error(deck_.place(node), "'" + key_.name + "' " + what, remedy);
  }

  std::nullopt_t wrong_type(const toml::node& node, const std::string& wanted) {
    std::ostringstream is;
    is << node.type();
    complain(node, "has the wrong type: " + is.str() + " instead of " + wanted, "give a " + type_name(key_));
    return std::nullopt;
  }

  /// Reports the error in a value, if any; returns whether there is none.
  bool good(const toml::node& node, const std::optional<ParameterError>& error, const std::string& word = {}) {
    if (error) complain(node, error->what, error->remedy.empty() ? suggestion(word, key_.choices) : error->remedy);
    return !error;
  }

  std::optional<double> read_real(const toml::node& node) {
    double value = 0;
    if (const auto* real = node.as_floating_point())
      value = real->get();
    else if (const auto* integer = node.as_integer())
      value = static_cast<double>(integer->get());
    else
      return wrong_type(node, "a number");
    if (!good(node, number_error(value, key_))) return {};
    if (const std::string error = beyond_limits(value, key_.type == Parameter::Type::vector_list);
        key_.unit != "-" && !error.empty()) {
      complain(node, error.substr(0, error.find("; ")), error.substr(error.find("; ") + 2));
      return {};
    }
    return value;
  }

  std::optional<std::int64_t> read_integer(const toml::node& node) {
    std::int64_t value = 0;
    const auto* real = node.as_floating_point();
    if (const auto* integer = node.as_integer())
      value = integer->get();
    else if (real != nullptr && std::abs(real->get()) < 0x1p53 && std::floor(real->get()) == real->get())
      value = static_cast<std::int64_t>(real->get());
    else
      return wrong_type(node, "an integer");
    const std::string word = std::to_string(value);
    if (!good(node, number_error(static_cast<double>(value), key_)) || !good(node, choice_error(word, key_), word))
      return {};
    return value;
  }

  std::optional<std::string> read_text(const toml::node& node) {
    std::string value;
    if (const auto* text = node.as_string()) {
      value = text->get();
    } else if (const auto* time = node.as_time()) {  // 00:05:00 without quotes
      std::ostringstream as_text;
      as_text << time->get();
      value = as_text.str();
    } else {
      return wrong_type(node, "a text");
    }
    if (!good(node, choice_error(value, key_), value)) return {};
    return value;
  }

  std::optional<PairList::value_type> read_pair(const toml::node& node) {
    const toml::array* pair = node.as_array();
    PairList::value_type ids{};
    if (pair == nullptr || pair->size() != 2) return wrong_type(node, "a pair of particle ids");
    for (std::size_t k = 0; k < 2; ++k) {
      const auto* id = pair->get(k)->as_integer();
      if (id == nullptr) return wrong_type(*pair->get(k), "a particle id");
      if (id->get() < 0 || id->get() > std::numeric_limits<std::uint32_t>::max()) {
        complain(*pair->get(k), "names the particle " + std::to_string(id->get()) + ", which cannot be",
                 "ids count the particles from 0 in the order of the deck");
        return {};
      }
      ids[k] = static_cast<std::uint32_t>(id->get());
    }
    return ids;
  }

  std::optional<TableValue> read_inline(const toml::node& node, const std::string& wanted) {
    const toml::table* table = node.as_table();
    if (table == nullptr) return wrong_type(node, wanted);
    TableValue values;
    std::vector<std::string> known;
    for (const Parameter& key : key_.keys) {
      known.push_back(key.name);
      const toml::node* item = table->get(key.name);
      if (item == nullptr)
        complain(node, "has no '" + key.name + "'",
                 "add it" + (key.choices.empty() ? ": " + type_name(key) : ", one of: " + join(key.choices)));
      else if (auto value = NodeReader(key, deck_, problems_).read(*item)) {
        if (const auto* number = std::get_if<double>(&*value)) values.emplace(key.name, *number);
        if (const auto* text = std::get_if<std::string>(&*value)) values.emplace(key.name, *text);
        if (const auto* pairs = std::get_if<std::vector<std::vector<double>>>(&*value))
          values.emplace(key.name, *pairs);
      }
    }
    for (const auto& [name, item] : *table)
      if (std::ranges::find(known, name.str()) == known.end())
        problems_.error(deck_.place(name, item), "unknown key '" + std::string(name.str()) + "' in '" + key_.name + "'",
                        suggestion(std::string(name.str()), known));
    if (values.size() != known.size() || table->size() != known.size()) return {};
    return values;
  }

  template <class T, class ReadItem>
  std::optional<std::vector<T>> read_list(const toml::node& node, ReadItem&& read_item) {
    const toml::array* array = node.as_array();
    if (array == nullptr) return wrong_type(node, "a list");
    std::vector<T> items;
    bool all = true;
    for (const toml::node& item : *array) {
      if (auto value = read_item(item))
        items.push_back(std::move(*value));
      else
        all = false;
    }
    if (!all) return {};
    return items;
  }

  const Parameter& key_;
  const DeckToml& deck_;
  Problems& problems_;
};

/// Sets missing values to their defaults; reports required values that are missing.
void complete(ValueTable& table, Problems& problems) {
  table.each_key([&](const Parameter& key) {
    if (table.given(key.name)) return;
    if (key.required())
      problems.error(table.at, "missing key '" + key.name + "' in " + table.schema->heading(),
                     "add it: " + type_name(key) + (key.meaning.empty() ? "" : ", " + key.meaning));
    if (key.has_default()) table.values.set(key.name, default_value(key));
  });
}

/// A remedy for a word that the schema does not know.
std::string remedy(const TableSchema& schema, const std::string& word, const std::vector<std::string>& known) {
  for (const auto& [former, instead] : schema.former)
    if (former == word) return instead;
  return suggestion(word, known);
}

const Variant* choose_variant(const toml::table& tables, const ValueTable& table, const DeckToml& deck,
                              Problems& problems) {
  const toml::node* type = tables.get("type");
  if (table.schema->variants.empty() || type == nullptr || !type->is_string()) return nullptr;
  const std::string& name = type->as_string()->get();
  const Variant* chosen = table.schema->variant(name);
  if (chosen != nullptr) return chosen;
  std::vector<std::string> names;
  for (const Variant& variant : table.schema->variants) names.push_back(variant.name);
  problems.error(deck.place(*type), "unknown " + table.schema->name + " '" + name + "'",
                 remedy(*table.schema, name, names));
  return nullptr;
}

ValueTable read_table(const toml::table& from, const TableSchema& schema, const DeckToml& deck, bool replace,
                      Problems& problems) {
  const std::size_t before = problems.errors();
  ValueTable table;
  table.schema = &schema;
  table.at = deck.place(from);
  if (schema.name.empty()) table.at = {deck.file};
  table.variant = choose_variant(from, table, deck, problems);
  std::vector<std::string> known;
  table.each_key([&](const Parameter& key) {
    known.push_back(key.name);
    const toml::node* node = from.get(key.name);
    if (node == nullptr) return;
    table.places.emplace(key.name, deck.place(*node));
    if (auto value = NodeReader(key, deck, problems).read(*node)) table.values.set(key.name, std::move(*value));
  });
  if (schema.name.empty())
    for (const TableSchema& other : deck_schema())
      if (!other.name.empty()) known.push_back(other.name);
  const bool type_unclear = !schema.variants.empty() && table.variant == nullptr;  // then its keys are not known
  const bool replaced = replace && table.variant != nullptr && deck.set.contains(from.get("type"));
  for (const auto& [key, node] : from) {
    const std::string name(key.str());
    if (type_unclear || std::ranges::find(known, name) != known.end()) continue;
    if (replaced && !deck.set.contains(&node)) continue;
    problems.error(deck.place(key, node), "unknown key '" + name + "' in " + schema.heading(),
                   remedy(schema, name, known));
  }
  complete(table, problems);
  table.wrong = problems.errors() > before;
  return table;
}

void read_tables(const TableSchema& schema, const DeckToml& deck, bool replace, DeckValues& values,
                 Problems& problems) {
  auto& list = values.tables[schema.name];
  const toml::node* node = schema.name.empty() ? &deck.root : deck.root.get(schema.name);
  if (node == nullptr) {
    if (schema.required)
      problems.error({deck.file}, "missing table " + schema.heading(), "add it: " + schema.meaning);
    else if (schema.name == "output")
      list.push_back(read_table({}, schema, deck, replace, problems));
    return;
  }
  if (!schema.list && node->is_table()) {
    list.push_back(read_table(*node->as_table(), schema, deck, replace, problems));
    return;
  }
  const toml::array* array = node->as_array();
  if (!schema.list || array == nullptr) {
    problems.error(deck.place(*node), "'" + schema.name + "' is not a " + (schema.list ? "list of tables" : "table"),
                   "write " + schema.heading() + " above its keys");
    return;
  }
  for (const toml::node& item : *array) {
    if (item.is_table())
      list.push_back(read_table(*item.as_table(), schema, deck, replace, problems));
    else
      problems.error(deck.place(item), "'" + schema.name + "' must hold tables only",
                     "write " + schema.heading() + " above each");
  }
  if (schema.required && list.empty())
    problems.error(deck.place(*node), "no " + schema.heading() + " at all", "add one: " + schema.meaning);
}

}  // namespace

std::string beyond_limits(double number, bool component) {
  const double size = std::abs(number);
  if (size <= kLargestNumber && (size >= kSmallestNumber || component || size == 0)) return {};
  return "is " + short_text(number) + ", and products with it would be " + (size > 1 ? "infinite" : "0") +
         "; take units in which it is between " + short_text(kSmallestNumber) + " and " + short_text(kLargestNumber);
}

Parameters ValueTable::of_variant() const {
  Parameters own;
  for (const Parameter& key : variant->keys)
    if (const auto value = values.all().find(key.name); value != values.all().end()) own.set(key.name, value->second);
  return own;
}

ValueTable table_of(std::string_view name, Parameters given) {
  ValueTable table;
  table.schema = &table_schema(name);
  if (table.schema->variants.empty()) {
    table.values = completed(name, table.schema->keys, std::move(given));
    return table;
  }
  const std::string type = given.text("type");
  table.variant = &find_named(table.schema->variants, name, type);
  given.erase("type");
  table.values = completed(type, table.variant->keys, std::move(given));
  table.values.set("type", type);
  return table;
}

DeckValues read_values(const std::filesystem::path& file, std::string_view text, std::span<const std::string> overrides,
                       bool replace, Problems& problems) {
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
  for (const std::string& each : overrides) apply(deck, each, problems);
  DeckValues values;
  values.file = deck.file;
  for (const TableSchema& schema : deck_schema()) read_tables(schema, deck, replace, values, problems);
  return values;
}

}  // namespace carom
