// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The interface between the loops over pairs and their kernels, which are compiled once for each vector width.
//
// A loop works on batches. The kernels collect pairs within the cutoff from a list (pair_records.h) into an array for
// each coordinate, the formula of a potential computes forces in quanta, and the kernels add them to the sums of both
// particles. Particles are numbered by their place in the list. Two dimensions are three with z = 0.

#include <cstddef>
#include <cstdint>

#include "engine/base/force_words.h"
#include "engine/base/vector_width.h"

namespace carom {

struct alignas(32) PairRecord {
  double x, y, z, w;
};

/// The partners of one particle through one image: with box numbers b (see PairRows), the separation of row and partner
/// is x_row − x_partner + (image − b_row + b_partner)·edges.
struct PairRun {
  std::uint32_t row, begin, count;  ///< partners begin … begin + count − 1
  std::int32_t image[3];
};

struct PairRows {
  const PairRecord* x = nullptr;           ///< positions; w: weight
  const PairRecord* x_new = nullptr;       ///< new positions for mean forces, or other vectors; else null
  bool vectors = false;                    ///< x_new has vectors, which have no images
  const PairRecord* box = nullptr;         ///< box numbers; null: all 0
  const std::uint32_t* partner = nullptr;  ///< padded by eight readable entries
  const PairRun* run = nullptr;
  std::size_t runs = 0;
  double edges[3] = {0, 0, 0};
  bool sheared = false;     ///< images along y are displaced along x, see Box; then all pairs have box numbers
  double turns = 0;         ///< the number of edges by which the tilt has become shorter since the images were found
  double tilt[2] = {0, 0};  ///< for x and for x_new
  double cutoff_squared = 0;
  bool weighted = false;  ///< multiply the weights and omit pairs of zero weight
};

/// The position in a list where the next batch begins.
struct PairCursor {
  std::size_t run = 0;
  std::uint32_t at = 0;
};

struct PairBatch {
  static constexpr unsigned kCapacity = 256, kPaddedCapacity = kCapacity + 8;  ///< pairs; entries including padding
  struct Row {
    std::uint32_t row, begin;  ///< pairs from `begin` to the next row's `begin` have this first particle
  };

  alignas(64) double d[3][kPaddedCapacity];      ///< separation, first minus second
  alignas(64) double d_new[3][kPaddedCapacity];  ///< new separation, or difference of vectors
  alignas(64) double weight[kPaddedCapacity];
  alignas(64) double above[kPaddedCapacity];          ///< the number of the image along y, in sheared boxes
  alignas(64) std::int64_t low[3][kPaddedCapacity];   ///< force on the first particle, in quanta
  alignas(64) std::int64_t high[3][kPaddedCapacity];  ///< high words, if two words are used
  std::uint32_t second[kCapacity + 16];
  Row row[kCapacity + 1];
  unsigned n = 0, rows = 0;

  PairBatch() {
    for (double& w : weight) w = 1;
  }
  /// Removes all pairs. Weights remain, which is correct because they are all 1 if the list has none.
  void clear() {
    for (; n % 8 != 0; ++n) weight[n] = 1;
    n = rows = 0;
  }
  /// Starts the pairs of a new first particle.
  void begin_row(std::uint32_t first) {
    if (rows > 0 && row[rows - 1].begin == n) --rows;  // reuses an empty row: there are at most n + 1 rows
    if (rows == 0 || row[rows - 1].row != first) row[rows++] = {first, n};
  }
  /// Fills the last vector with pairs of zero weight.
  void pad() {
    row[rows].begin = n;
    for (unsigned k = n; k % 8 != 0; ++k) {
      for (int axis = 0; axis < 3; ++axis) d[axis][k] = d[axis][0], d_new[axis][k] = d_new[axis][0];
      weight[k] = 0;
    }
    for (unsigned k = n; k < n + 4; ++k) second[k] = row[0].row;  // any valid place
  }
  std::uint32_t first_of(unsigned pair) const {
    unsigned r = 0;
    while (row[r + 1].begin <= pair) ++r;
    return row[r].row;
  }
};

/// Units and limits of the results of formulas.
struct PairUnits {
  double per_force = 1;   ///< 1/quantum, or −1/quantum to subtract
  double per_energy = 0;  ///< 1/quantum; virials, which are larger, are in units of 64 quanta
  ForceLimits limits{0, 0};
};

/// Sums over a batch, in quanta; virial: in units of 64 quanta.
struct PairTotals {
  __extension__ using Whole = __int128;
  Whole energy = 0, magnitude = 0, virial = 0;
};

/// The formulas of one potential in one vector width. `wide`: forces in two words. They return false if a value does
/// not fit.
struct PairFormula {
  using Function = bool (*)(const void* potential, PairBatch&, const PairUnits&, PairTotals*);
  Function forces[2], forces_and_sums[2], mean_forces[2], hessian_product[2];  ///< index: `wide`
};

/// A search for the partners of one particle in a range of places, when a list is built.
struct PartnerSearch {
  // Bits of a particle's code: may be wrapped, first species, second species.
  static constexpr std::uint64_t kFirst = 1, kSecond = 2, kMoving = 1ULL << 63;
  const double* x[3] = {};  ///< coordinates in the box
  const std::uint64_t* code = nullptr;
  std::uint32_t row = 0;
  double own[3];  ///< its position, shifted by the image
  double reach_squared = 0;
  std::uint64_t wanted = 0;  ///< the partner's code must have the highest of these bits
  bool plain = false;        ///< pairs with partners that are not moving are plain
  bool here = false;         ///< the image is zero
};
/// The results: plain pairs and others; each array has room for `count` more entries plus eight.
struct PartnersFound {
  std::uint32_t *plain, *other;
};

struct PairKernels {
  const char* name;
  /// Fills a batch; returns false at the end of the list, with an empty batch.
  bool (*collect)(const PairRows&, PairCursor&, PairBatch&);
  /// Adds the words of a batch to the sums of both particles.
  void (*scatter)(const PairBatch&, const std::int64_t (*words)[PairBatch::kPaddedCapacity], ForceWords* sums);
  void (*find)(const PartnerSearch&, std::uint32_t begin, std::uint32_t end, PartnersFound&);
  const PairFormula* formulas;  ///< for each of PairPotentials
};

}  // namespace carom
