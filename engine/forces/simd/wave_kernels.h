// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The interface between the Ewald sum and its loops over waves, which are compiled once for each vector width.
//
// Waves stand in rows of consecutive c, k = 2π (a/L_x, b/L_y, c/L_z); the last entries of a row may be padding, of
// which the fields are zero. Sums have eight partial sums whatever the width, so that all widths give the same bits.

#include <cstddef>
#include <cstdint>

#include "engine/base/vector_width.h"

namespace carom {

struct WaveRow {
  static constexpr unsigned kMultiple = 8;
  int a, b, c;            ///< c: of the first wave
  unsigned first, count;  ///< the waves first … first + count − 1; both are multiples of kMultiple
};

/// The waves, and one particle: e^(2πi n x/L) along each axis, where the pointers are those of n = 0.
struct WaveTask {
  const WaveRow* rows;
  std::size_t n;
  const double *re[3], *im[3];  ///< the third ones have kMultiple readable entries after the last n
};

/// A linear function of a, b and c.
struct WaveFactor {
  double constant, a, b, c;
};

struct WaveKernels {
  /// Adds factor·e^(ik·x) + shift to re and im, as bits.
  void (*add)(const WaveTask&, const WaveFactor& factor, double shift, std::uint64_t* re, std::uint64_t* im);
  /// Σ (a, b, c) Im[field* e^(ik·x)]
  void (*pull)(const WaveTask&, const double* re, const double* im, double* sum);
  /// Σ (a, b, c) sin(y)/y Im[field* e^(ik·x)], |y| ≤ 1
  void (*pull_moved)(const WaveTask&, const WaveFactor& y, const double* re, const double* im, double* sum);
  /// Σ (a, b, c) factor Re[field* e^(ik·x)]
  void (*pull_change)(const WaveTask&, const WaveFactor& factor, const double* re, const double* im, double* sum);
};

}  // namespace carom
