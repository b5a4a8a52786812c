#include "engine/exact_sum.h"

#include <bit>
#include <cmath>
#include <limits>

namespace carom {

namespace {
constexpr int kLowestBit = -1074;  // weight of the least bit of the least digit
constexpr std::int64_t kLow32 = 0xffffffff;
constexpr std::int64_t kTermsBeforeCarry = std::int64_t{1} << 30;
}  // namespace

void ExactSum::add(double term) {
  const auto bits = std::bit_cast<std::uint64_t>(term);
  const int biased = static_cast<int>(bits >> 52) & 0x7ff;
  if (biased == 0x7ff) {
    invalid_ = true;
    return;
  }
  std::uint64_t mantissa = bits & 0xfffffffffffffULL;
  if (biased != 0) mantissa |= 1ULL << 52;
  const int position = biased == 0 ? 0 : biased - 1;  // of the mantissa's least bit, above kLowestBit
  const int digit = position / 32, shift = position % 32;
  const std::uint64_t low = mantissa << shift;
  const std::uint64_t high = shift == 0 ? 0 : mantissa >> (64 - shift);
  const std::int64_t sign = (bits >> 63) != 0 ? -1 : 1;
  digit_[digit] += sign * static_cast<std::int64_t>(low & kLow32);
  digit_[digit + 1] += sign * static_cast<std::int64_t>(low >> 32);
  digit_[digit + 2] += sign * static_cast<std::int64_t>(high);
  if (++pending_ == kTermsBeforeCarry) carry();
}

__extension__ void ExactSum::add(__int128 multiple, double power_of_two) {
  for (double unit = power_of_two; multiple != 0; unit *= 0x1p48) {
    const auto low = static_cast<std::int64_t>(multiple & 0xffffffffffff);
    add(static_cast<double>(low) * unit);
    multiple >>= 48;
    if (multiple == -1) {  // a negative number: its upper part is −1 for ever
      add(-unit * 0x1p48);
      break;
    }
  }
}

void ExactSum::add(const ExactSum& other) {
  ExactSum tidy = other;
  tidy.carry();
  carry();
  for (int k = 0; k < kDigits; ++k) digit_[k] += tidy.digit_[k];
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
  ExactSum tidy = *this;
  tidy.carry();
  const bool negative = tidy.digit_[kDigits - 1] < 0;
  if (negative) {
    for (auto& d : tidy.digit_) d = -d;
    tidy.carry();
  }
  int top = kDigits - 1;
  while (top > 0 && tidy.digit_[top] == 0) --top;
  auto digit = [&](int k) { return k < 0 ? 0 : static_cast<std::uint64_t>(tidy.digit_[k]); };
  // The leading 64 bits, the lowest of them standing for everything below ("sticky"); the conversion rounds once.
  const int lead = std::countl_zero(digit(top)) - 32;
  std::uint64_t window = (digit(top) << 32 | digit(top - 1)) << lead;
  if (lead > 0) window |= digit(top - 2) >> (32 - lead);
  bool sticky = lead > 0 ? (digit(top - 2) << lead & 0xffffffff) != 0 : digit(top - 2) != 0;
  for (int k = top - 3; k >= 0 && !sticky; --k) sticky = digit(k) != 0;
  if (sticky) window |= 1;
  const double magnitude = std::ldexp(static_cast<double>(window), kLowestBit + 32 * (top - 1) - lead);
  return negative ? -magnitude : magnitude;
}

}  // namespace carom
