// SPDX-License-Identifier: BSD-3-Clause
#include "io/deck/options.h"

#include <charconv>
#include <cmath>

namespace carom {

std::optional<double> wall_seconds(std::string_view text) {
  double seconds = 0;
  for (int part = 0; part < 3; ++part) {
    const std::size_t colon = text.find(':');
    const std::string_view digits = text.substr(0, colon);
    double value = 0;
    const auto [end, failed] =
        std::from_chars(digits.data(), digits.data() + digits.size(), value, std::chars_format::fixed);
    const bool last = colon == std::string_view::npos;
    if (failed != std::errc{} || end != digits.data() + digits.size() || !(value >= 0) || !std::isfinite(value))
      return {};
    if (!last && value != std::floor(value)) return {};  // only the seconds may have a fraction
    seconds = 60 * seconds + value;
    if (last) return seconds;
    text.remove_prefix(colon + 1);
  }
  return {};
}

}  // namespace carom
