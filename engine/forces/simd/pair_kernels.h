// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The interface between loops over pairs and their kernels, which exist once for each vector width.
//
// A loop works on batches: kernels collect pairs within the cutoff from a list (pair_records.h) into arrays of one
// coordinate each, a potential's formula turns them into forces in quanta, and kernels add these to the sums of both
// particles. Particles are numbered here by their place in the list. Two dimensions are three with z = 0.

#include <cstddef>
#include <cstdint>

#include "engine/base/force_words.h"
#include "engine/base/vector_width.h"

namespace carom {

/// Of a particle.
struct alignas(32) PairRecord {
  double x, y, z, w;
};

/// Partners of one particle through one image: with box numbers b (see PairRows) the separation of row and partner is
/// x_row − x_partner + (image − b_row + b_partner)·edges.
struct PairRun {
  std::uint32_t row, begin, count;  ///< partners begin … begin + count − 1
  std::int32_t image[3];
};

struct PairRows {
  const PairRecord* x = nullptr;           ///< positions; w: weight
  const PairRecord* x_new = nullptr;       ///< new positions, for mean forces, or other vectors; else null
  bool vectors = false;                    ///< these are vectors of the particles: they have no images
  const PairRecord* box = nullptr;         ///< box numbers; null: all 0
  const std::uint32_t* partner = nullptr;  ///< eight more than there are can be read
  const PairRun* run = nullptr;
  std::size_t runs = 0;
  double edges[3] = {0, 0, 0};
  double cutoff_squared = 0;
  bool weighted = false;  ///< multiply the weights, leave out pairs of zero weight
};

/// Where in a list the next batch begins.
struct PairCursor {
  std::size_t run = 0;
  std::uint32_t at = 0;
};

struct PairBatch {
  static constexpr unsigned kCapacity = 256, kRoom = kCapacity + 8;  ///< pairs; numbers that can be read
  struct Row {
    std::uint32_t row, begin;  ///< pairs from `begin` to that of the next row have this first particle
  };

  alignas(64) double d[3][kRoom];      ///< separation, first minus second
  alignas(64) double d_new[3][kRoom];  ///< the new one, or the difference of vectors
  alignas(64) double weight[kRoom];
  alignas(64) std::int64_t low[3][kRoom];   ///< force on the first, in quanta
  alignas(64) std::int64_t high[3][kRoom];  ///< where it took two words
  std::uint32_t second[kCapacity + 16];
  Row row[kCapacity + 1];
  unsigned n = 0, rows = 0;

  PairBatch() {
    for (double& w : weight) w = 1;
  }
  /// Empties it. Weights stay as they are, which is 1 where the list has none.
  void clear() {
    for (; n % 8 != 0; ++n) weight[n] = 1;
    n = rows = 0;
  }
  /// Begins the pairs of another first particle.
  void begin_row(std::uint32_t first) {
    if (rows > 0 && row[rows - 1].begin == n) --rows;  // an empty one: there are never more rows than pairs, and one
    if (rows == 0 || row[rows - 1].row != first) row[rows++] = {first, n};
  }
  /// Makes the last vector whole by pairs of zero weight.
  void pad() {
    row[rows].begin = n;
    for (unsigned k = n; k % 8 != 0; ++k) {
      for (int axis = 0; axis < 3; ++axis) d[axis][k] = d[axis][0], d_new[axis][k] = d_new[axis][0];
      weight[k] = 0;
    }
    for (unsigned k = n; k < n + 4; ++k) second[k] = row[0].row;  // some place
  }
  std::uint32_t first_of(unsigned pair) const {
    unsigned r = 0;
    while (row[r + 1].begin <= pair) ++r;
    return row[r].row;
  }
};

/// Units and limits of what formulas give.
struct PairUnits {
  double per_force = 1;   ///< 1/quantum, or −1/quantum to subtract
  double per_energy = 0;  ///< 1/quantum; virials, which are larger, are counted in 64 of these
  ForceLimits limits{0, 0};
};

/// Sums over a batch, in quanta; the virial in 64 of these.
struct PairTotals {
  __extension__ using Whole = __int128;
  Whole energy = 0, magnitude = 0, virial = 0;
};

/// One potential in one vector width. `wide`: in two words. False where something does not fit.
struct PairFormula {
  using Function = bool (*)(const void* potential, PairBatch&, const PairUnits&, PairTotals*);
  Function forces[2], forces_and_sums[2], mean_forces[2], hessian_product[2];  ///< by `wide`
};

/// A look at some particles for the partners of one, when a list is made.
struct PartnerSearch {
  // Codes of particles: may leave the box, a ghost, of the first and of the second species; one of the former two.
  static constexpr std::uint64_t kMoving = 1, kGhost = 2, kFirst = 4, kSecond = 8, kOdd = 1ULL << 63;
  const double* x[3] = {};  ///< coordinates in the box
  const std::uint64_t* code = nullptr;
  std::uint32_t row = 0;
  double own[3];  ///< its position, with the image's shift
  double reach_squared = 0;
  std::uint64_t wanted = 0;  ///< the highest of these bits of the partner's code
  bool plain = false;        ///< not odd
  bool here = false;         ///< no other image
};
/// Where it goes: pairs that are plain, and others. Room for `count` more of each, and eight.
struct PartnersFound {
  std::uint32_t *plain, *other;
};

struct PairKernels {
  const char* name;
  /// Fills a batch; false where the list is at its end and the batch empty.
  bool (*collect)(const PairRows&, PairCursor&, PairBatch&);
  /// Adds the words of a batch to the sums of both particles.
  void (*scatter)(const PairBatch&, const std::int64_t (*words)[PairBatch::kRoom], ForceWords* sums);
  void (*find)(const PartnerSearch&, std::uint32_t begin, std::uint32_t end, PartnersFound&);
  const PairFormula* formulas;  ///< of each of PairPotentials
};

}  // namespace carom
