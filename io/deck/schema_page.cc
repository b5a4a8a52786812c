// SPDX-License-Identifier: BSD-3-Clause
// The schema and the methods as pages to read.

#include <algorithm>
#include <iterator>
#include <sstream>

#include "engine/integrators/integrator.h"
#include "engine/laws/interaction.h"
#include "io/deck/deck_problems.h"
#include "io/deck/schema.h"

namespace carom {
namespace {

/// Breaks text into lines of at most 100 characters, all but the first indented.
std::string wrapped(const std::string& text, std::size_t indent) {
  constexpr std::size_t width = 100;
  std::istringstream words(text);
  std::string out, word;
  std::size_t column = indent;
  while (words >> word) {
    if (column > indent && column + 1 + word.size() > width) {
      out += "\n" + std::string(indent, ' ');
      column = indent;
    } else if (column > indent) {
      out += ' ';
      ++column;
    }
    out += word;
    column += word.size();
  }
  return out;
}

std::string fallback(const Parameter& key) {
  return key.required() ? "required" : key.has_default() ? "default " + key.fallback : "optional";
}

std::string meaning(const Parameter& key) {
  if (key.choices.empty()) return key.meaning;
  return key.meaning + (key.meaning.empty() ? "" : "; ") + "one of: " + join(key.choices);
}

std::string heading(const TableSchema& table) { return table.name.empty() ? "Top of the deck" : table.heading(); }

/// A line about a variant, from the declaration of the integrator or interaction it stands for.
std::string about(const TableSchema& table, const std::string& variant) {
  if (table.name == "integrator") return std::string(find_integrator(variant).title);
  if (table.name == "interaction") return "V = " + std::string(find_interaction(variant).formula);
  return {};
}

void plain_keys(std::ostream& out, const std::vector<Parameter>& keys, std::size_t indent) {
  for (const Parameter& key : keys) {
    const std::string unit = key.unit.empty() || key.unit == "-" ? "" : " [" + key.unit + "]";
    out << std::string(indent, ' ') << key.name << ": " << type_name(key) << unit << ", " << fallback(key) << '\n';
    if (const std::string text = meaning(key); !text.empty())
      out << std::string(indent + 4, ' ') << wrapped(text, indent + 4) << '\n';
  }
}

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '|' ? std::string("\\|") : std::string(1, c);
  return out;
}

void markdown_keys(std::ostream& out, const std::vector<Parameter>& keys) {
  if (keys.empty()) return;
  out << "| key | type | unit | default | meaning |\n|---|---|---|---|---|\n";
  for (const Parameter& key : keys)
    out << "| `" << key.name << "` | " << type_name(key) << " | " << (key.unit == "-" ? "" : key.unit) << " | "
        << (key.has_default() ? "`" + key.fallback + "`"
            : key.required()  ? "*required*"
                              : "*optional*")
        << " | " << escaped(meaning(key)) << " |\n";
  out << '\n';
}

}  // namespace

std::string schema_page(bool markdown) {
  std::ostringstream out;
  if (markdown) out << "# Keys of a deck\n\n";
  for (const TableSchema& table : deck_schema()) {
    if (markdown) {
      out << "## `" << heading(table) << "`\n\n" << table.meaning << ".\n\n";
      markdown_keys(out, table.keys);
    } else {
      out << heading(table) << " – " << wrapped(table.meaning, 4) << '\n';
      plain_keys(out, table.keys, 2);
    }
    for (const Variant& variant : table.variants) {
      const std::string text = about(table, variant.name);
      if (markdown) {
        out << "### `type = \"" << variant.name << "\"`\n\n";
        if (!text.empty()) out << escaped(text) << "\n\n";
        markdown_keys(out, variant.keys);
      } else {
        out << "  type = \"" << variant.name << "\"" << (text.empty() ? "" : " – " + wrapped(text, 6)) << '\n';
        plain_keys(out, variant.keys, 6);
      }
    }
    if (!markdown) out << '\n';
  }
  return out.str();
}

std::string methods_page() {
  std::ostringstream out;
  const auto about = [&](const auto& info, const std::vector<Parameter>& keys) {
    out << "  " << wrapped(std::string(info.documentation), 2) << "\n  parameters:\n";
    plain_keys(out, keys, 4);
    out << "  source: " << wrapped(std::string(info.source), 10) << "\n\n";
  };
  for (const IntegratorInfo& info : integrators()) {
    out << info.name << " – " << info.title << "\n  order:     " << info.order
        << "\n  conserves: " << wrapped(std::string(info.conserves), 13) << '\n';
    about(info, table_schema("integrator").variant(info.name)->keys);
  }
  for (const ObservableInfo& info : observables()) {
    out << info.name << ".csv – " << info.title << '\n';
    std::vector<Parameter> keys;
    std::ranges::copy_if(table_schema("output").keys, std::back_inserter(keys),
                         [&](const Parameter& key) { return key.name.starts_with(std::string(info.name) + "_"); });
    about(info, keys);
  }
  return out.str();
}

}  // namespace carom
