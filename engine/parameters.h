#pragma once
// Declared parameters: what an integrator or an interaction can be given in a deck, and the values it was given.
//
// A declaration is written once, beside the code that uses the value. The deck's schema, its validation, the
// `carom schema` and `carom methods` pages and the resolved deck are all made from it.

#include <array>
#include <cstdint>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace carom {

struct Parameter {
  enum class Type { boolean, integer, real, real_list, text, text_list, pair_list };
  enum class Range { any, positive, non_negative };

  std::string_view name;
  Type type = Type::real;
  std::string_view fallback;  ///< the default as TOML text; "" = must be given; "none" = may be left out
  std::string_view unit;      ///< dimension, for instance "length", "energy/length^2", "-" for a pure number
  std::string_view meaning;   ///< one sentence for the manual
  Range range = Range::any;   ///< for integer and real (and each of real_list)
  std::vector<std::string_view> choices{};                ///< for text: what it may be; empty = anything
  std::vector<std::array<std::string_view, 2>> former{};  ///< for text: what it may no longer be, and the remedy
};

/// Pairs of particle ids.
using PairList = std::vector<std::array<std::uint32_t, 2>>;

using ParameterValue =
    std::variant<bool, std::int64_t, double, std::vector<double>, std::string, std::vector<std::string>, PairList>;

/// Validated values by name. Every declared parameter with a default is present; those with "none" only where given.
class Parameters {
 public:
  void set(std::string name, ParameterValue value) { values_[std::move(name)] = std::move(value); }
  bool has(std::string_view name) const { return values_.find(name) != values_.end(); }
  /// The value of a declared parameter; std::out_of_range if it is absent, std::bad_variant_access on the wrong type.
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

}  // namespace carom
