// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The innermost loops, compiled for several vector widths; the width is chosen when a core is made.
//
// `scan` finds the first contact of one sphere among its candidates, several at a time and without branches; `near`
// finds the spheres around a position in the cells of region_cells.h. All widths give the same bits: every lane
// executes the same operations in the same order.

#include <cstddef>
#include <cstdint>

#include "engine/base/vector_width.h"

namespace carom {

/// The constants of all scans of one core. Each record has 8 doubles (record.h).
struct ScanSetting {
  const double* records = nullptr;
  const double* radius = nullptr;  ///< by slot; null if all spheres have one diameter
  double diameter = 0;
  double edges[3] = {0, 0, 0};  ///< edges of the box, which determine the shifts of images
  double g[3] = {0, 0, 0};      ///< common acceleration
  double growth = 0;            ///< contact distances are multiplied by 1 + growth·t
  std::uint32_t slot_mask = 0;  ///< selects the slot of a candidate (Packing)
  int slot_bits = 0, field_bits = 0;
  bool plain = true;  ///< one diameter, no acceleration, no growth
};

struct ScanResult {
  double time;          ///< time of the first contact; ∞: none; −∞: two spheres overlap, test each
  std::uint32_t which;  ///< index of the partner among the candidates, if there is one
  bool tied;            ///< another contact may have the same time: test each
};

/// A sphere to scan and its candidates, padded with `self` to a multiple of ScanKernels::lanes.
struct ScanTask {
  std::uint32_t self;
  const std::uint32_t* candidates;
  unsigned n;
  unsigned same;  ///< the first `same` candidates are in the sphere's box; later ones may be
};

/// Eight spheres of a cell: positions in 1024ths of the cell, ten bits per axis, and slots (kEmpty for an unused
/// entry).
struct alignas(64) CellLine {
  std::uint32_t place[8];
  std::uint32_t slot[8];
};
inline constexpr std::uint32_t kEmpty = 0xffffffff;

/// A step to a cell along one axis.
struct CellStep {
  std::uint32_t line;  ///< is added to the number of the cell's first line
  std::int32_t away;   ///< the boxes that the step crosses, as a linear image
};

/// A step to a cell along one axis, as seen from a sphere.
struct CellView : CellStep {
  float corner;   ///< position of the cell's lower face [length]
  float squared;  ///< square of the distance to the nearest point of these cells
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
  std::ptrdiff_t offset;  ///< is added to the number of the cell
  std::uint32_t away;     ///< the boxes that the step crosses, shifted to the image bits of a candidate
};

/// Rows of cells whose heads are to be read: heads are candidates with the images of their cells, or kEmpty.
struct HeadsTask {
  const std::uint32_t* first;  ///< the first cell of the row without any step
  const HeadStep* step[2];     ///< steps to the rows
  unsigned steps[2];
  unsigned wanted;     ///< one bit for each of the first three cells of a row; four are read
  std::uint32_t away;  ///< is added to all steps
  std::uint32_t here;  ///< the image bits of a candidate in the same box
};
struct Heads {
  unsigned count;
  std::uint32_t any;  ///< all bits in which a head differs from `here`
};

/// The kernels of one vector width.
struct ScanKernels {
  unsigned lanes;  ///< candidates that are scanned together: lists are padded to a multiple
  /// The first contact of a sphere with one of its candidates, by dimension − 2. `latest` states that no candidate's
  /// record has a later time than the sphere's.
  ScanResult (*scan[2])(const ScanSetting&, const ScanTask&, bool latest);
  /// Scans the two spheres of a collision: no candidate's record may have a later time than theirs.
  void (*scan_two[2])(const ScanSetting&, const ScanTask* task, ScanResult* result);
  /// Writes the slots of all spheres within the limit and the linear images of their cells; returns their number. The
  /// arrays must have room for all spheres in the cells.
  unsigned (*near)(const NearTask&, std::uint32_t* slots, std::int32_t* away);
  /// Compares n candidates with a list, which is read in blocks of eight: copies the candidates that are not in the
  /// list to `fresh`, returns their number, and sets a bit in `kept` (initially 0) for each list entry that is among
  /// the candidates.
  unsigned (*compare)(const std::uint32_t* list, unsigned length, const std::uint32_t* candidates, unsigned n,
                      std::uint32_t* fresh, std::uint64_t* kept);
  /// Writes the first sphere of each cell, as seen from the sphere of the task; the array needs space for four more.
  Heads (*heads)(const HeadsTask&, std::uint32_t* candidates);
};

}  // namespace carom
