// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The innermost loops, compiled several times for different vector widths and chosen when a core is made.
//
// `scan` finds the first contact of one sphere among its candidates, several at a time and without branches; `near`
// finds the spheres around a place in the cells of region_cells.h. All widths give the same bits: the same operations
// in the same order in every lane.

#include <cstddef>
#include <cstdint>

#include "engine/base/vector_width.h"

namespace carom {

/// What scans of one core have in common. Records are given as 8 doubles each (record.h).
struct ScanSetting {
  const double* records = nullptr;
  const double* radius = nullptr;  ///< by slot; null where all spheres have one diameter
  double diameter = 0;
  double edges[3] = {0, 0, 0};  ///< of the box, to multiply images with
  double g[3] = {0, 0, 0};      ///< common acceleration
  double growth = 0;            ///< contact distances are multiplied by 1 + growth·t
  std::uint32_t slot_mask = 0;  ///< of a candidate (Packing)
  int slot_bits = 0, field_bits = 0;
  bool plain = true;  ///< one diameter, no acceleration, no growth
};

struct ScanResult {
  double time;          ///< of the first contact; infinite: none; −infinite: two spheres overlap, look one by one
  std::uint32_t which;  ///< its place among the candidates, if there is one
  bool tied;            ///< another contact may have the same time: look one by one
};

/// A sphere to scan for, and its candidates, padded with `self` to a multiple of ScanKernels::lanes.
struct ScanTask {
  std::uint32_t self;
  const std::uint32_t* candidates;
  unsigned n;
  unsigned same;  ///< the first so many are in the same box as the sphere; others may be
};

/// Eight spheres of a cell: places in 1024ths of the cell, ten bits an axis, and slots (kEmpty where there is none).
struct alignas(64) CellLine {
  std::uint32_t place[8];
  std::uint32_t slot[8];
};
inline constexpr std::uint32_t kEmpty = 0xffffffff;

/// A step to a cell along one axis.
struct CellStep {
  std::uint32_t line;  ///< what it adds to the number of the cell's first line
  std::int32_t away;   ///< the boxes it leads through, as a linear image
};

/// The same, seen from a sphere.
struct CellView : CellStep {
  float corner;   ///< where the cell starts [length]
  float squared;  ///< square of the distance to the nearest point of the cells there
};

struct NearTask {
  const CellLine* lines;
  const std::uint32_t* next;  ///< by line: the next line of the same cell, or kEmpty
  const CellView* view[3];    ///< along each axis
  unsigned views[3];
  float scale[3];  ///< length of 1/1024 of a cell, by axis
  float limit_squared;
};

/// A step to a linked cell (linked_cells.h) along one axis.
struct HeadStep {
  std::ptrdiff_t offset;  ///< what it adds to the number of the cell
  std::uint32_t away;     ///< the boxes it leads through, in the bits that an image has in a candidate
};

/// Rows of cells to read the heads of: candidates in the boxes they stand in, or kEmpty.
struct HeadsTask {
  const std::uint32_t* first;  ///< the first cell of the row that no step leads to
  const HeadStep* step[2];     ///< to the rows
  unsigned steps[2];
  unsigned wanted;     ///< one bit for each of the first three cells of a row; four are read
  std::uint32_t away;  ///< added to all steps
  std::uint32_t here;  ///< what a candidate in the same box has beside its slot
};
struct Heads {
  unsigned count;
  std::uint32_t any;  ///< all bits in which one of them differs from `here`
};

/// The kernels of one vector width.
struct ScanKernels {
  unsigned lanes;  ///< candidates looked at together: their lists are padded to a multiple of it
  /// The first contact of a sphere with one of its candidates. `latest`: none of their records is of a later time than
  /// its own. By dimension − 2.
  ScanResult (*scan[2])(const ScanSetting&, const ScanTask&, bool latest);
  /// The same for the two spheres of a collision: no record is of a later time than theirs.
  void (*scan_two[2])(const ScanSetting&, const ScanTask* task, ScanResult* result);
  /// Writes slots and linear images of the cells of all spheres within the limit; returns how many. The arrays must
  /// hold as many as there are in the cells.
  unsigned (*near)(const NearTask&, std::uint32_t* slots, std::int32_t* away);
  /// Compares n candidates with a list, which is read by eight: copies those that are not in it to `fresh` and returns
  /// how many, and sets a bit in `kept` (zeros before) for each one of the list that is among them.
  unsigned (*compare)(const std::uint32_t* list, unsigned length, const std::uint32_t* candidates, unsigned n,
                      std::uint32_t* fresh, std::uint64_t* kept);
  /// Writes the first sphere of each cell, as seen from the sphere of the task; there must be room for four more.
  Heads (*heads)(const HeadsTask&, std::uint32_t* candidates);
};

}  // namespace carom
