// SPDX-License-Identifier: BSD-3-Clause
#include "engine/base/parameters.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "engine/base/error.h"

namespace carom {
namespace {

/// In the order of ParameterValue and of Parameter::Type.
constexpr std::array kTypes = {"true or false", "a whole number",  "a number",           "a list of numbers",
                               "a text",        "a list of texts", "a list of id pairs", "a list of vectors",
                               "a table"};

[[noreturn]] void refuse(std::string_view of, const std::string& what, const std::string& remedy) {
  throw Error(Failure::deck, std::string(of) + ": " + what + "; " + remedy);
}

std::string quoted(std::string_view name) { return std::string(1, '\'').append(name) + '\''; }

std::string listed(const auto& words) {
  std::string list;
  for (const std::string_view word : words) list += (list.empty() ? "" : ", ") + std::string(word);
  return list;
}

void check(std::string_view of, const Parameter& parameter, const ParameterValue& value) {
  const auto type = static_cast<std::size_t>(parameter.type);
  const bool plain = std::holds_alternative<double>(value);
  const bool either =
      (parameter.type == Parameter::Type::real_or_table && (plain || std::holds_alternative<TableValue>(value))) ||
      (parameter.type == Parameter::Type::real_or_list &&
       (plain || std::holds_alternative<std::vector<double>>(value))) ||
      (parameter.type == Parameter::Type::real_or_pairs &&
       (plain || std::holds_alternative<std::vector<std::vector<double>>>(value)));
  if (value.index() != type && !either)
    refuse(of, quoted(parameter.name) + " is " + kTypes[value.index()],
           std::string("give ") + (type < kTypes.size()                              ? kTypes[type]
                                   : parameter.type == Parameter::Type::real_or_list ? "a number or a list"
                                                                                     : "a number or a table"));
  const auto complain = [&](const std::optional<ParameterError>& error) {
    if (!error) return;
    refuse(of, quoted(parameter.name) + " " + error->what,
           error->remedy.empty() ? "give one of: " + listed(parameter.choices) : error->remedy);
  };
  const auto check_number = [&](double number) { complain(number_error(number, parameter)); };
  if (const auto* real = std::get_if<double>(&value)) check_number(*real);
  if (const auto* whole = std::get_if<std::int64_t>(&value)) {
    check_number(static_cast<double>(*whole));
    complain(choice_error(std::to_string(*whole), parameter));
  }
  if (const auto* table = std::get_if<TableValue>(&value)) {
    for (const Parameter& key : parameter.keys) {
      const auto at = table->find(key.name);
      if (at == table->end())
        refuse(of, quoted(parameter.name) + " has no " + quoted(key.name), "add it: " + key.meaning);
      std::visit([&](const auto& each) { check(of, key, each); }, at->second);
    }
    if (table->size() > parameter.keys.size())
      refuse(of, quoted(parameter.name) + " has an unknown key", "leave it out");
  }
  if (const auto* list = std::get_if<std::vector<double>>(&value)) std::ranges::for_each(*list, check_number);
  if (const auto* text = std::get_if<std::string>(&value)) complain(choice_error(*text, parameter));
}

}  // namespace

std::optional<ParameterError> number_error(double value, const Parameter& parameter) {
  const std::string is = short_text(value, 15);
  if (!std::isfinite(value)) return ParameterError{{}, "must be finite (is " + is + ")", "give an ordinary number"};
  if (value > parameter.most) return ParameterError{{}, "is " + is, "take at most " + short_text(parameter.most, 15)};
  if (parameter.range == Parameter::Range::positive && !(value > 0))
    return ParameterError{{}, "must be positive (is " + is + ")", "give a number above 0"};
  if (parameter.range == Parameter::Range::non_negative && value < 0)
    return ParameterError{{}, "must be zero or positive (is " + is + ")", "give 0 or a number above"};
  return {};
}

std::optional<ParameterError> choice_error(const std::string& word, const Parameter& parameter) {
  const auto& choices = parameter.choices;
  if (choices.empty() || std::ranges::find(choices, word) != choices.end()) return {};
  for (const auto& [former, remedy] : parameter.former)
    if (word == former) return ParameterError{{}, "can no longer be " + quoted(word), remedy};
  return ParameterError{{}, "cannot be " + quoted(word), {}};
}

ParameterValue default_value(const Parameter& parameter) {
  const std::string_view text = parameter.fallback;
  const char* const end = text.data() + text.size();
  if (parameter.type == Parameter::Type::boolean) return text == "true";
  if (parameter.type == Parameter::Type::text) return std::string(text.substr(1, text.size() - 2));
  if (std::int64_t whole = 0; parameter.type == Parameter::Type::integer) {
    std::from_chars(text.data(), end, whole);
    return whole;
  }
  double real = 0;
  const bool number = parameter.type == Parameter::Type::real || parameter.type == Parameter::Type::real_or_list ||
                      parameter.type == Parameter::Type::real_or_table;
  if (!number || std::from_chars(text.data(), end, real).ec != std::errc{})
    throw std::logic_error("the default of " + quoted(parameter.name) + " cannot be read");
  return real;
}

Parameters completed(std::string_view of, std::span<const Parameter> declared, Parameters given) {
  for (const auto& [name, value] : given.all()) find_named(declared, "parameter of " + std::string(of), name);
  for (const Parameter& parameter : declared) {
    const std::string& name = parameter.name;
    if (!given.has(name)) {
      if (parameter.required()) refuse(of, "missing parameter " + quoted(name), "give it: " + parameter.meaning);
      if (parameter.has_default()) given.set(name, default_value(parameter));
      continue;
    }
    ParameterValue value = given.all().find(name)->second;
    if (const auto* whole = std::get_if<std::int64_t>(&value);
        whole && (parameter.type == Parameter::Type::real || parameter.type == Parameter::Type::real_or_list ||
                  parameter.type == Parameter::Type::real_or_table))
      value = static_cast<double>(*whole);
    check(of, parameter, value);
    given.set(name, std::move(value));
  }
  return given;
}

void throw_unknown(std::string_view kind, std::string_view name, std::span<const std::string_view> known) {
  throw Error(Failure::deck, "unknown " + std::string(kind) + " " + quoted(name) + "; give one of: " + listed(known));
}

}  // namespace carom
