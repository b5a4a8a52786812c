// SPDX-License-Identifier: BSD-3-Clause
#include "engine/base/exact_sum.h"

#include <bit>
#include <cmath>
#include <limits>

namespace carom {

namespace {
constexpr int kLowestBit = -1074;  // weight of the least bit of the least digit
}  // namespace

__extension__ void ExactSum::add(__int128 multiple, double power_of_two) {
  for (double unit = power_of_two; multiple != 0; unit *= 0x1p48) {
    const auto low = static_cast<std::int64_t>(multiple & 0xffffffffffff);
    add(static_cast<double>(low) * unit);
    multiple >>= 48;
    if (multiple == -1) {  // a negative number: all its higher digits are −1
      add(-unit * 0x1p48);
      break;
    }
  }
}

void ExactSum::add(const ExactSum& other) {
  ExactSum carried = other;
  carried.carry();
  carry();
  for (int k = 0; k < kDigits; ++k) digit_[k] += carried.digit_[k];
  pending_ = 2;
  invalid_ = invalid_ || other.invalid_;
}

void ExactSum::carry() {  // afterwards every digit but the highest is in [0, 2^32)
  for (int k = 0; k + 1 < kDigits; ++k) {
    digit_[k + 1] += digit_[k] >> 32;
    digit_[k] &= kLow32;
  }
  pending_ = 0;
}

double ExactSum::value() const {
  if (invalid_) return std::numeric_limits<double>::quiet_NaN();
  ExactSum carried = *this;
  carried.carry();
  const bool negative = carried.digit_[kDigits - 1] < 0;
  if (negative) {
    for (auto& d : carried.digit_) d = -d;
    carried.carry();
  }
  int top = kDigits - 1;
  while (top > 0 && carried.digit_[top] == 0) --top;
  auto digit = [&](int k) { return k < 0 ? 0 : static_cast<std::uint64_t>(carried.digit_[k]); };
  // The leading 64 bits; the lowest stands for all digits below it ("sticky"). The conversion rounds once.
  const int lead = std::countl_zero(digit(top)) - 32;
  std::uint64_t window = (digit(top) << 32 | digit(top - 1)) << lead;
  if (lead > 0) window |= digit(top - 2) >> (32 - lead);
  bool sticky = lead > 0 ? (digit(top - 2) << lead & 0xffffffff) != 0 : digit(top - 2) != 0;
  for (int k = top - 3; k >= 0 && !sticky; --k) sticky = digit(k) != 0;
  if (sticky) window |= 1;
  const double magnitude = std::ldexp(static_cast<double>(window), kLowestBit + 32 * (top - 1) - lead);
  return negative ? -magnitude : magnitude;
}

void ExactSeries::add_alone(double term) { sum_.add(term); }

void ExactSeries::flush() {
  sum_.add(high_);
  sum_.add(low_);
  high_ = low_ = 0;
}

void ExactSeries::begin(double first) {
  flush();
  limit_ = 0;
  if (!(std::abs(first) > 0x1p-900 && std::abs(first) < 0x1p900)) return;
  limit_ = std::ldexp(1.0, std::ilogb(first) + 13);
  // Adding these rounds to multiples of 2^-44 and 2^-89 of the limit: 512 terms, or remainders, stay below 2^53
  // multiples.
  to_high_ = 0x1.8p8 * limit_;
  to_low_ = 0x1.8p-37 * limit_;
  left_ = 512;
}

}  // namespace carom
