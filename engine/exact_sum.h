#pragma once
// A sum of doubles that does not depend on the order of its terms.
//
// Reported sums (energy, momentum, virial) must be the same digits on any number of ranks. ExactSum is a small Kulisch
// accumulator: a fixed-point number wide enough for every double, kept in 32-bit digits inside 64-bit limbs so that
// carries can wait. Adding a term is exact; value() rounds once. (Kulisch, Computer Arithmetic and Validity, 2008.)

#include <array>
#include <cstdint>

namespace carom {

class ExactSum {
 public:
  /// Adds one term. A NaN or infinity makes the whole sum NaN.
  void add(double term);
  /// Adds so many times a power of two.
  __extension__ void add(__int128 multiple, double power_of_two);
  /// Adds another sum: the parts of several ranks may be joined in any order.
  void add(const ExactSum& other);
  /// The sum, rounded once to nearest.
  double value() const;
  void clear() { *this = ExactSum(); }

 private:
  void carry();
  static constexpr int kDigits = 70;  // 2^-1074 … 2^1024 and room for 2^60 terms
  std::array<std::int64_t, kDigits> digit_{};
  std::int64_t pending_ = 0;  // terms since the last carry
  bool invalid_ = false;
};

}  // namespace carom
