// SPDX-License-Identifier: BSD-3-Clause
#include "engine/laws/bath.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace carom {
namespace {

/// The number with the Poisson distribution of mean 1 that a uniform number in (0, 1) stands for.
int poisson(double uniform) {
  constexpr int kMostKicks = 18;              // more have a probability of 3·10⁻¹⁸
  double probability = 0x1.78b56362cef38p-2;  // 1/e
  int k = 0;
  for (double sum = probability; k < kMostKicks && uniform > sum; sum += probability) probability /= ++k;
  return k;
}

}  // namespace

// Time is divided into cells of length 1/rate. Each has a Poisson number of kicks, at uniform times.
double Bath::next_kick(Id id, double origin, double t, double until) const {
  constexpr double kNoKick = std::numeric_limits<double>::infinity();
  constexpr std::uint64_t kBlocksOfCell = 16;  // two numbers each: enough for the number of kicks and their times
  for (double cell = std::floor((origin + t) * rate); cell / rate - origin < until; ++cell) {
    RandomStream random(seed, RandomPurpose::kick_time, id, kBlocksOfCell * static_cast<std::uint64_t>(cell));
    double next = kNoKick;
    for (int kicks = poisson(random.uniform()); kicks > 0; --kicks)
      if (const double s = (cell + random.uniform()) / rate - origin; s > t) next = std::min(next, s);
    if (next < kNoKick) return next;
  }
  return kNoKick;
}

}  // namespace carom
