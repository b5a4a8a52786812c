// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <array>

namespace carom {

/// Two independent normal deviates of mean 0 and variance 1 from two uniform ones in (0, 1): √(−2 ln u) times the
/// cosine and the sine of 2π·turn (Box, Muller, Ann. Math. Stat. 29 (1958) 610). The same bits on every machine. The
/// error is below 0.502 ulp, plus the 2^-62 by which the rounded angle moves a deviate.
std::array<double, 2> normal_deviates(double u, double turn);

/// The cosine and the sine of 2π·turn for any number of turns, with the same bits on every machine.
std::array<double, 2> cosine_and_sine(double turn);

}  // namespace carom
