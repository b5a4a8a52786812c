// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <charconv>

#include "io/deck/deck_values.h"

namespace carom {
namespace {

std::string literal(bool value) { return value ? "true" : "false"; }
std::string literal(std::int64_t value) { return std::to_string(value); }
std::string literal(std::uint32_t value) { return std::to_string(value); }

/// The shortest decimal number that reads back as the same double.
std::string literal(double value) {
  std::array<char, 32> buffer{};
  const auto [end, failed] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  std::string text(buffer.data(), end);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text;
}

std::string literal(const std::string& value) {
  std::string text = "\"";
  for (const char c : value) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      text += std::string("\\") + c;
    } else if (c == '\n') {
      text += "\\n";
    } else if (code < 0x20 || code == 0x7f) {
      constexpr std::string_view digits = "0123456789ABCDEF";
      text += std::string("\\u00") + digits[code / 16] + digits[code % 16];
    } else {
      text += c;
    }
  }
  return text + "\"";
}

/// A list of any of these, or of lists.
std::string literal(const auto& items) {
  std::string text;
  for (const auto& item : items) text += (text.empty() ? "" : ", ") + literal(item);
  return "[" + text + "]";
}

std::string literal(const TableValue& table) {
  std::string text;
  for (const auto& [name, value] : table)
    text +=
        (text.empty() ? "" : ", ") + name + " = " + std::visit([](const auto& each) { return literal(each); }, value);
  return "{ " + text + " }";
}

}  // namespace

std::string write_deck(const DeckValues& values) {
  std::string text;
  for (const TableSchema& schema : deck_schema())
    for (const ValueTable& table : values.list(schema.name)) {
      if (!schema.name.empty()) text.append("\n").append(schema.heading()).append("\n");
      table.each_key([&](const Parameter& key) {
        const auto at = table.values.all().find(key.name);
        if (at == table.values.all().end()) return;
        text += key.name + " = " + std::visit([](const auto& value) { return literal(value); }, at->second) + "\n";
      });
    }
  return text;
}

}  // namespace carom
