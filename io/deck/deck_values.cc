// SPDX-License-Identifier: BSD-3-Clause
#include "io/deck/deck_values.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "io/deck/deck_toml.h"

namespace carom {
namespace {

/// Reads one node as what its key declares; complains at the innermost node that is wrong.
class NodeReader {
 public:
  NodeReader(const Key& key, const DeckToml& deck, Problems& problems) : key_(key), deck_(deck), problems_(problems) {}

  std::optional<Value> read(const toml::node& node) {
    using enum Key::Type;
    switch (key_.type) {
      case boolean:
        if (const auto* b = node.as_boolean()) return Value(b->get());
        return wrong_type(node, "true or false");
      case integer:
        return wrap(read_integer(node));
      case real:
        return wrap(read_real(node));
      case real_list:
        return wrap(read_list<double>(node, [this](const toml::node& n) { return read_real(n); }));
      case text:
        return wrap(read_text(node));
      case text_list:
        return wrap(read_list<std::string>(node, [this](const toml::node& n) { return read_text(n); }));
      case pair_list:
        return wrap(read_list<PairList::value_type>(node, [this](const toml::node& n) { return read_pair(n); }));
      case vector_list:
        return wrap(read_list<std::vector<double>>(node, [this](const toml::node& n) {
          return read_list<double>(n, [this](const toml::node& m) { return read_real(m); });
        }));
      case real_or_list:
        if (!node.is_array()) return wrap(read_real(node));
        return wrap(read_list<double>(node, [this](const toml::node& n) { return read_real(n); }));
      case text_table:
        return wrap(read_texts(node));
    }
    return {};
  }

 private:
  template <class T>
  static std::optional<Value> wrap(std::optional<T> value) {
    if (!value) return {};
    return Value(std::move(*value));
  }

  void complain(const toml::node& node, const std::string& what, const std::string& remedy) {
    problems_.error(deck_.place(node), "'" + key_.name + "' " + what, remedy);
  }

  std::nullopt_t wrong_type(const toml::node& node, const std::string& wanted) {
    std::ostringstream is;
    is << node.type();
    complain(node, "has the wrong type: " + is.str() + " instead of " + wanted, "give a " + type_name(key_));
    return std::nullopt;
  }

  bool in_range(const toml::node& node, double value) {
    const auto error = number_error(value, key_.range, key_.most);
    if (error) complain(node, error->what, error->remedy);
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
    if (!in_range(node, value)) return {};
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
    if (!in_range(node, static_cast<double>(value)) || !chosen(node, std::to_string(value))) return {};
    return value;
  }

  bool chosen(const toml::node& node, const std::string& value) {
    if (key_.choices.empty() || std::find(key_.choices.begin(), key_.choices.end(), value) != key_.choices.end())
      return true;
    for (const auto& [former, remedy] : key_.former)
      if (value == former) return complain(node, "can no longer be '" + value + "'", std::string(remedy)), false;
    complain(node, "cannot be '" + value + "'", suggestion(value, key_.choices));
    return false;
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
    if (!chosen(node, value)) return {};
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

  std::optional<std::map<std::string, std::string>> read_texts(const toml::node& node) {
    const toml::table* table = node.as_table();
    if (table == nullptr) return wrong_type(node, "a table");
    std::map<std::string, std::string> texts;
    std::vector<std::string> known;
    for (const Key& key : key_.keys) {
      known.push_back(key.name);
      const toml::node* item = table->get(key.name);
      if (item == nullptr)
        complain(node, "has no '" + key.name + "'", "add it, one of: " + join(key.choices));
      else if (auto text = NodeReader(key, deck_, problems_).read_text(*item))
        texts.emplace(key.name, std::move(*text));
    }
    for (const auto& [name, item] : *table)
      if (std::ranges::find(known, name.str()) == known.end())
        problems_.error(deck_.place(name, item), "unknown key '" + std::string(name.str()) + "' in '" + key_.name + "'",
                        suggestion(std::string(name.str()), known));
    if (texts.size() != known.size() || table->size() != known.size()) return {};
    return texts;
  }

  template <class T, class ReadItem>
  std::optional<std::vector<T>> read_list(const toml::node& node, ReadItem&& read_item) {
    const toml::array* array = node.as_array();
    if (array == nullptr) return wrong_type(node, "a list");
    std::vector<T> items;
    bool good = true;
    for (const toml::node& item : *array) {
      if (auto value = read_item(item))
        items.push_back(std::move(*value));
      else
        good = false;
    }
    if (!good) return {};
    return items;
  }

  const Key& key_;
  const DeckToml& deck_;
  Problems& problems_;
};

std::string bracketed(const TableSchema& schema) {
  if (schema.name.empty()) return "the deck";
  return schema.list ? "[[" + schema.name + "]]" : "[" + schema.name + "]";
}

/// Values left out get their defaults; those that have none and are needed are reported.
void complete(ValueTable& table, const DeckToml& deck, Problems& problems) {
  table.each_key([&](const Key& key) {
    if (table.given(key.name)) return;
    if (key.required())
      problems.error(table.at, "missing key '" + key.name + "' in " + bracketed(*table.schema),
                     "add it: " + type_name(key) + (key.meaning.empty() ? "" : ", " + key.meaning));
    if (!key.has_default()) return;
    const toml::table fallback = toml::parse("value = " + key.fallback);
    if (auto value = NodeReader(key, deck, problems).read(*fallback.get("value")))
      table.values.emplace(key.name, std::move(*value));
  });
}

/// What to write instead of a word that the schema does not know.
std::string remedy(const TableSchema& schema, const std::string& word, const std::vector<std::string>& known) {
  for (const auto& [former, instead] : schema.former)
    if (former == word) return std::string(instead);
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

ValueTable read_table(const toml::table& from, const TableSchema& schema, const DeckToml& deck, Problems& problems) {
  ValueTable table;
  table.schema = &schema;
  table.at = deck.place(from);
  if (schema.name.empty()) table.at = {deck.file};
  table.variant = choose_variant(from, table, deck, problems);
  std::vector<std::string> known;
  table.each_key([&](const Key& key) {
    known.push_back(key.name);
    const toml::node* node = from.get(key.name);
    if (node == nullptr) return;
    table.places.emplace(key.name, deck.place(*node));
    if (auto value = NodeReader(key, deck, problems).read(*node)) table.values.emplace(key.name, std::move(*value));
  });
  if (schema.name.empty())
    for (const TableSchema& other : deck_schema())
      if (!other.name.empty()) known.push_back(other.name);
  const bool type_unclear = !schema.variants.empty() && table.variant == nullptr;  // then its keys are not known
  for (const auto& [key, node] : from) {
    const std::string name(key.str());
    if (type_unclear || std::find(known.begin(), known.end(), name) != known.end()) continue;
    problems.error(deck.place(key, node), "unknown key '" + name + "' in " + bracketed(schema),
                   remedy(schema, name, known));
  }
  complete(table, deck, problems);
  return table;
}

void read_tables(const TableSchema& schema, const DeckToml& deck, DeckValues& values, Problems& problems) {
  auto& list = values.tables[schema.name];
  const toml::node* node = schema.name.empty() ? &deck.root : deck.root.get(schema.name);
  if (node == nullptr) {
    if (schema.required)
      problems.error({deck.file}, "missing table " + bracketed(schema), "add it: " + schema.meaning);
    else if (schema.name == "output")
      list.push_back(read_table({}, schema, deck, problems));
    return;
  }
  if (!schema.list && node->is_table()) {
    list.push_back(read_table(*node->as_table(), schema, deck, problems));
    return;
  }
  const toml::array* array = node->as_array();
  if (!schema.list || array == nullptr) {
    problems.error(deck.place(*node), "'" + schema.name + "' is not a " + (schema.list ? "list of tables" : "table"),
                   "write " + bracketed(schema) + " above its keys");
    return;
  }
  for (const toml::node& item : *array) {
    if (item.is_table())
      list.push_back(read_table(*item.as_table(), schema, deck, problems));
    else
      problems.error(deck.place(item), "'" + schema.name + "' must hold tables only",
                     "write " + bracketed(schema) + " above each");
  }
  if (schema.required && list.empty())
    problems.error(deck.place(*node), "no " + bracketed(schema) + " at all", "add one: " + schema.meaning);
}

}  // namespace

std::vector<ValueTable>& DeckValues::list(std::string_view name) { return tables.find(name)->second; }
const std::vector<ValueTable>& DeckValues::list(std::string_view name) const { return tables.find(name)->second; }

const ValueTable* DeckValues::find(std::string_view name) const {
  const auto& all = list(name);
  return all.empty() ? nullptr : &all.front();
}
ValueTable* DeckValues::find(std::string_view name) {
  auto& all = list(name);
  return all.empty() ? nullptr : &all.front();
}

DeckValues read_values(const DeckToml& deck, Problems& problems) {
  DeckValues values;
  values.file = deck.file;
  for (const TableSchema& schema : deck_schema()) read_tables(schema, deck, values, problems);
  return values;
}

}  // namespace carom
