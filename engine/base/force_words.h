// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The words of ForceSums (force_sums.h), as kernels see them.

#include <cstdint>

namespace carom {

/// One word of each component; the same for two and three dimensions, where kernels add them.
struct alignas(32) ForceWords {
  std::int64_t of[4] = {0, 0, 0, 0};

  void add(const ForceWords& other) {
    for (int k = 0; k < 4; ++k) of[k] += other.of[k];
  }
};

/// Of a term of V: what is small beside it may be rounded. 0: it gives no hint.
struct ForceScale {
  double force = 0, energy = 0;
  double spread = 1;  ///< so many times larger are both between the particles of the largest weights
};

inline constexpr int kHighShift = 40;          // a high word counts so many times two low ones
inline constexpr double kMostInLow = 0x1p50;   // quanta; more goes into two words
inline constexpr double kMostInHigh = 0x1p46;  // of 2^40 quanta
inline constexpr double kForceRoom = 0x1p62;   // that sums of words may use

/// What one force, given in quanta, may be at most.
struct ForceLimits {
  double low, high;  ///< in the low word alone; in the high one of two
};

}  // namespace carom
