// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Declared parameters of integrators, interactions and observables, as given in a deck, and their values.
//
// A declaration is written once, beside the code that uses the value. The deck's schema and validation, the pages of
// `carom schema` and `carom methods`, and the resolved deck are generated from it.

#include <array>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace carom {

struct Parameter {
  /// The first nine are in the order of ParameterValue.
  enum class Type {
    boolean,
    integer,  ///< a real number without a fraction (1e6) will do
    real,     ///< an integer will do
    real_list,
    text,
    text_list,
    pair_list,
    vector_list,    ///< one vector of system.dimension numbers for each particle
    table,          ///< an inline table: `keys`
    real_or_list,   ///< a number, or a list of numbers
    real_or_table,  ///< a number, or an inline table: `keys`
    real_or_pairs,  ///< in an inline table: a number, or pairs of numbers
  };
  enum class Range { any, positive, non_negative };

  std::string name;
  Type type = Type::real;
  std::string fallback;                ///< the default as TOML text; "" = required; "none" = optional without default
  std::string unit;                    ///< dimension, for instance "length", "energy/length^2", "-" for a pure number
  std::string meaning;                 ///< one sentence for the manual
  Range range = Range::any;            ///< for integer, real and each number of a list
  std::vector<std::string> choices{};  ///< for text: the allowed values; empty = any
  std::vector<std::array<std::string, 2>> former{};       ///< for text: former values, each with what to write instead
  double most = std::numeric_limits<double>::infinity();  ///< for numbers: the largest allowed value
  std::vector<Parameter> keys{};  ///< a table has these keys: numbers, texts and pairs, all required

  bool required() const { return fallback.empty(); }
  bool has_default() const { return !required() && fallback != "none"; }
};

/// Pairs of particle ids.
using PairList = std::vector<std::array<std::uint32_t, 2>>;

/// An inline table.
using TableValue = std::map<std::string, std::variant<double, std::string, std::vector<std::vector<double>>>>;

using ParameterValue = std::variant<bool, std::int64_t, double, std::vector<double>, std::string,
                                    std::vector<std::string>, PairList, std::vector<std::vector<double>>, TableValue>;

/// Validated values by name. Parameters with a default are always present, those declared "none" only if given.
class Parameters {
 public:
  Parameters() = default;
  Parameters(std::initializer_list<std::pair<const std::string, ParameterValue>> values) : values_(values) {}
  void set(std::string name, ParameterValue value) { values_[std::move(name)] = std::move(value); }
  void erase(const std::string& name) { values_.erase(name); }
  bool has(std::string_view name) const { return values_.find(name) != values_.end(); }
  /// The value, or null if it is absent or of another type.
  template <class T>
  const T* find(std::string_view name) const {
    const auto at = values_.find(name);
    return at == values_.end() ? nullptr : std::get_if<T>(&at->second);
  }
  /// The value of a declared parameter; throws std::out_of_range if absent, std::bad_variant_access if of another type.
  template <class T>
  const T& get(std::string_view name) const {
    const auto at = values_.find(name);
    if (at == values_.end()) throw std::out_of_range("no parameter '" + std::string(name) + "'");
    return std::get<T>(at->second);
  }
  double real(std::string_view name) const { return get<double>(name); }
  std::int64_t integer(std::string_view name) const { return get<std::int64_t>(name); }
  bool flag(std::string_view name) const { return get<bool>(name); }
  const std::string& text(std::string_view name) const { return get<std::string>(name); }
  const std::map<std::string, ParameterValue, std::less<>>& all() const { return values_; }

 private:
  std::map<std::string, ParameterValue, std::less<>> values_;
};

/// What is wrong with a parameter's value, and what to do about it.
struct ParameterError {
  std::string_view parameter;
  std::string what, remedy;
};

/// Checks a number; returns nothing if it is finite, in the range and at most `most`.
std::optional<ParameterError> number_error(double value, const Parameter& parameter);

/// Checks a text, or an integer written as text; returns nothing if it is one of the choices, or if there are none. An
/// empty remedy means: use one of the choices.
std::optional<ParameterError> choice_error(const std::string& word, const Parameter& parameter);

/// The parsed default: true, false, a number or a quoted word (Parameter::fallback).
ParameterValue default_value(const Parameter& parameter);

/// `given`, completed with defaults; whole numbers become reals if the parameter is real. Throws Error(Failure::deck)
/// if a value is missing, unknown, of another type, out of range or none of the choices; `of` names what the parameters
/// belong to.
Parameters completed(std::string_view of, std::span<const Parameter> declared, Parameters given);

/// Throws Error(Failure::deck): no `kind` has this name; the message lists `known`.
[[noreturn]] void throw_unknown(std::string_view kind, std::string_view name, std::span<const std::string_view> known);

/// The declaration with this name.
template <class Infos>
const auto& find_named(const Infos& declared, std::string_view kind, std::string_view name) {
  std::vector<std::string_view> known;
  for (const auto& each : declared) {
    if (each.name == name) return each;
    known.push_back(each.name);
  }
  throw_unknown(kind, name, known);
}

}  // namespace carom
