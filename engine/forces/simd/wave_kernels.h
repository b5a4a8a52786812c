// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The interface between the Ewald sum and its loops over waves, which are compiled once for each vector width.
//
// The waves k = 2π (a/L_x, b/L_y, ±c/L_z) stand in rows of consecutive c ≥ 0. With X = 2π (a x/L_x + b y/L_y) and
// Z = 2π c z/L_z, the waves of +c and −c are linear in four products: cos X cos Z, sin X sin Z, cos X sin Z,
// sin X cos Z. Amplitudes are sums of these products, in blocks: eight numbers of the first product, for eight values
// of c, then eight of the second one, and so on. Sums have eight partial sums whatever the width, so that all widths
// give the same bits.

#include <cstddef>
#include <cstdint>

#include "engine/base/vector_width.h"

namespace carom {

struct WaveRow {
  static constexpr unsigned kMultiple = 8;
  static constexpr unsigned kProducts = 4;
  int a, b;
  unsigned first, count;  ///< its entries; multiples of kMultiple, where the last ones may be padding of weight zero
};

/// The place of a product of an entry in the amplitudes.
constexpr std::size_t place_of(std::size_t entry, unsigned product) {
  constexpr std::size_t kIn = WaveRow::kMultiple;
  return entry / kIn * kIn * WaveRow::kProducts + product * kIn + entry % kIn;
}

/// Rows, and one particle: e^(2πi n x/L) along each axis, where the pointers are those of n = 0.
struct WaveTask {
  const WaveRow* rows;
  std::size_t n;
  const double *re[3], *im[3];  ///< the third ones have kMultiple readable entries after the last n
};

/// The vectors `w` and `y` are in units of L/2π: k·w = a w[0] + b w[1] ± c w[2]. `field` has the amplitudes φ of a
/// potential Σ φ · product. All but the first two add to the sum of three components, in units of 2π/L.
struct WaveKernels {
  /// Adds factor × product + shift to the amplitudes, as bits.
  void (*add)(const WaveTask&, double factor, double shift, std::uint64_t* amplitudes);
  /// The derivatives of the products along w in the place of the products.
  void (*add_change)(const WaveTask&, double factor, const double* w, double shift, std::uint64_t* amplitudes);
  /// Minus the gradient of the potential.
  void (*pull)(const WaveTask&, const double* field, double* sum);
  /// The derivative of the latter along w.
  void (*pull_change)(const WaveTask&, const double* w, const double* field, double* sum);
  /// As `pull`, with each wave times sin(k·y)/(k·y); |k·y| ≤ most ≤ 1.
  void (*pull_moved)(const WaveTask&, const double* y, double most, const double* field, double* sum);
};

}  // namespace carom
