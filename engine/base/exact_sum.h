// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A sum of doubles that does not depend on the order of its terms.
//
// Reported sums (energy, momentum, virial) must have the same digits on any number of ranks. ExactSum is a small
// Kulisch accumulator: a fixed-point number wide enough for every double, stored as 32-bit digits in 64-bit limbs so
// that carries can be delayed. Adding a term is exact; value() rounds once. (Kulisch, Computer Arithmetic and Validity,
// 2008.)

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

namespace carom {

class ExactSum {
 public:
  /// Adds one term. A NaN or infinity makes the whole sum NaN.
  void add(double term);
  /// Adds `multiple` times a power of two.
  __extension__ void add(__int128 multiple, double power_of_two);
  /// Adds another sum; the sums of several ranks can be added in any order.
  void add(const ExactSum& other);
  /// The sum, rounded once to nearest.
  double value() const;

 private:
  void carry();
  static constexpr int kDigits = 70;  // 2^-1074 … 2^1024 and room for 2^60 terms
  static constexpr std::int64_t kLow32 = 0xffffffff;
  static constexpr std::int64_t kTermsBeforeCarry = std::int64_t{1} << 30;
  std::array<std::int64_t, kDigits> digit_{};
  std::int64_t pending_ = 0;  // terms since the last carry
  bool invalid_ = false;
};

/// An exact sum of many terms, fast if most are about as large as the first nonzero one. Terms of that size are split
/// into multiples of two powers of two, which doubles sum exactly.
class ExactSeries {
 public:
  [[gnu::always_inline]] void add(double term) {
    if (left_ == 0) begin(term);
    if (!(std::abs(term) < limit_)) return add_alone(term);
    const double high = (term + to_high_) - to_high_, rest = term - high;
    const double low = (rest + to_low_) - to_low_;
    high_ += high;
    low_ += low;
    --left_;
    if (low != rest) add_alone(rest - low);
  }
  ExactSum sum() {
    flush();
    return sum_;
  }

 private:
  void add_alone(double term);
  void flush();
  void begin(double first);

  ExactSum sum_;
  double limit_ = 0;  // upper bound of terms that are split
  double to_high_ = 0, to_low_ = 0, high_ = 0, low_ = 0;
  int left_ = 0;  // terms that can be added before the sums are flushed
};

inline void ExactSum::add(double term) {
  const auto bits = std::bit_cast<std::uint64_t>(term);
  const int biased = static_cast<int>(bits >> 52) & 0x7ff;
  if (biased == 0x7ff) {
    invalid_ = true;
    return;
  }
  std::uint64_t mantissa = bits & 0xfffffffffffffULL;
  if (biased != 0) mantissa |= 1ULL << 52;
  const int position = biased == 0 ? 0 : biased - 1;  // the mantissa's lowest bit, counted from kLowestBit
  const int digit = position / 32, shift = position % 32;
  const std::uint64_t low = mantissa << shift;
  const std::uint64_t high = shift == 0 ? 0 : mantissa >> (64 - shift);
  const std::int64_t sign = (bits >> 63) != 0 ? -1 : 1;
  digit_[digit] += sign * static_cast<std::int64_t>(low & kLow32);
  digit_[digit + 1] += sign * static_cast<std::int64_t>(low >> 32);
  digit_[digit + 2] += sign * static_cast<std::int64_t>(high);
  if (++pending_ == kTermsBeforeCarry) carry();
}

}  // namespace carom
