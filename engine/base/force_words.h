// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The words of ForceSums (force_sums.h), as the kernels access them.

#include <cstdint>

namespace carom {

/// One word for each component; two and three dimensions have the same layout.
struct alignas(32) ForceWords {
  std::int64_t of[4] = {0, 0, 0, 0};

  void add(const ForceWords& other) {
    for (int k = 0; k < 4; ++k) of[k] += other.of[k];
  }
};

/// Typical sizes for a term of V, below which quantities may be rounded. 0: unknown.
struct ForceScale {
  double force = 0, energy = 0;
  double spread = 1;  ///< factor by which both are larger between the particles of the largest weights
};

inline constexpr int kHighShift = 40;           // a high word counts 2^40 times a low one
inline constexpr double kMaxLowWord = 0x1p50;   // [quanta]; larger forces use both words
inline constexpr double kMaxHighWord = 0x1p46;  // [2^40 quanta]
inline constexpr double kMaxWordSum = 0x1p62;   // largest sum of words

/// Upper bounds of one force, in quanta.
struct ForceLimits {
  double low, high;  ///< for the low word alone; for the high word of two
};

}  // namespace carom
