#include "engine/base/parameters.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "engine/base/error.h"

namespace carom {
namespace {

/// In the order of ParameterValue and of Parameter::Type.
constexpr std::array kTypes = {"true or false", "a whole number",  "a number",          "a list of numbers",
                               "a text",        "a list of texts", "a list of id pairs"};

[[noreturn]] void refuse(std::string_view of, const std::string& what, const std::string& remedy) {
  throw Error(Failure::deck, std::string(of) + ": " + what + "; " + remedy);
}

std::string quoted(std::string_view name) { return std::string(1, '\'').append(name) + '\''; }

/// A default, which is true, false, a number or a quoted word (Parameter::fallback).
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
  if (parameter.type != Parameter::Type::real || std::from_chars(text.data(), end, real).ec != std::errc{})
    throw std::logic_error("the default of " + quoted(parameter.name) + " cannot be read");
  return real;
}

std::string listed(std::span<const std::string_view> words) {
  std::string list;
  for (const std::string_view word : words) list += (list.empty() ? "" : ", ") + std::string(word);
  return list;
}

void check_number(std::string_view of, const Parameter& parameter, double value) {
  const std::string name = quoted(parameter.name);
  if (!std::isfinite(value)) refuse(of, name + " is not finite", "give a finite number");
  if (parameter.range == Parameter::Range::positive && !(value > 0))
    refuse(of, name + " is " + std::to_string(value), "give a positive number");
  if (parameter.range == Parameter::Range::non_negative && value < 0)
    refuse(of, name + " is negative", "give zero or a positive number");
  if (value > parameter.most)
    refuse(of, name + " is " + std::to_string(value), "take at most " + std::to_string(parameter.most));
}

void check(std::string_view of, const Parameter& parameter, const ParameterValue& value) {
  const auto type = static_cast<std::size_t>(parameter.type);
  if (value.index() != type)
    refuse(of, quoted(parameter.name) + " is " + kTypes[value.index()], std::string("give ") + kTypes[type]);
  if (const auto* real = std::get_if<double>(&value)) check_number(of, parameter, *real);
  if (const auto* whole = std::get_if<std::int64_t>(&value)) check_number(of, parameter, static_cast<double>(*whole));
  if (const auto* list = std::get_if<std::vector<double>>(&value))
    for (const double each : *list) check_number(of, parameter, each);
  const auto* text = std::get_if<std::string>(&value);
  if (!text || parameter.choices.empty() || std::ranges::find(parameter.choices, *text) != parameter.choices.end())
    return;
  refuse(of, quoted(parameter.name) + " cannot be " + quoted(*text), "give one of: " + listed(parameter.choices));
}

}  // namespace

Parameters completed(std::string_view of, std::span<const Parameter> declared, Parameters given) {
  for (const auto& [name, value] : given.all())
    if (std::ranges::find(declared, name, &Parameter::name) == declared.end()) {
      std::vector<std::string_view> known;
      for (const Parameter& each : declared) known.push_back(each.name);
      refuse(of, "unknown parameter " + quoted(name), "the parameters are: " + listed(known));
    }
  for (const Parameter& parameter : declared) {
    const std::string name(parameter.name);
    if (!given.has(name)) {
      if (parameter.fallback.empty())
        refuse(of, "missing parameter " + quoted(name), "give it: " + std::string(parameter.meaning));
      if (parameter.fallback != "none") given.set(name, default_value(parameter));
      continue;
    }
    ParameterValue value = given.all().find(name)->second;
    if (const auto* whole = std::get_if<std::int64_t>(&value); whole && parameter.type == Parameter::Type::real)
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
