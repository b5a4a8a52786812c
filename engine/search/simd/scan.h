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

/// The core of a pair or one of its steps (../../laws/steps.h).
struct ScanSurface {
  double distance, squared;
  double margin;  ///< a pair may be on either side if its squared distance differs from `squared` by less than this
};

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
  bool plain = true;                      ///< one diameter, no acceleration, no growth, no shear
  bool sheared = false;                   ///< otherwise plain, but the box is sheared
  double tilt = 0, slide = 0;             ///< of the image above, at time 0, along the first axis (Offset)
  const ScanSurface* surfaces = nullptr;  ///< for scan_steps: the core and the steps, from the inside out
  unsigned surface_count = 0;
};

struct ScanResult {
  double time;          ///< time of the first contact; ∞: none; −∞: two spheres overlap, test each
  std::uint32_t which;  ///< index of the partner among the candidates, if there is one
  bool tied;            ///< another contact may have the same time: test each
};

/// What scan_steps finds.
struct StepScan {
  ScanResult first;    ///< the first event with a candidate that is not near a surface
  std::uint64_t near;  ///< bit q is set if candidate q is near a surface and must be tested alone
};

/// The most candidates that a kernel scans together: lists are padded to a multiple.
inline constexpr unsigned kScanLanes = 4;
/// Candidates in a block: their times are stored until the smallest is known.
inline constexpr unsigned kScanBlock = 64;

/// A sphere to scan and its candidates, padded with `self` to a multiple of kScanLanes.
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
  float scale[3];       ///< length of 1/1024 of a cell, by axis
  float limit_squared;  ///< of the distance
  float cells_squared;  ///< of the distance of cells
  /// Distances are the least ones under strains from mean − half to mean + half (flow_frame.h); both are 0 without
  /// flow.
  float mean_strain, half_strain;
};

/// A step to a row of linked cells (linked_cells.h).
struct alignas(32) HeadStep {
  std::uint32_t away[4];  ///< the boxes that the step crosses, shifted to the image bits of a candidate: four times
  std::ptrdiff_t offset;  ///< is added to the number of the cell
};

/// Steps from a cell's own row to other rows; the own row is the last one if it is among them.
struct HeadRows {
  HeadStep step[9];
  unsigned count;  ///< at least 1, or 0 beyond a wall
};

/// A later sphere of a linked cell.
struct CellLink {
  std::uint32_t next;  ///< the next sphere in the cell, coded like a head
  std::int32_t boxes;  ///< image of the sphere's cell, as a linear image
};
/// Flag of a head: another sphere of the cell follows.
inline constexpr std::uint32_t kMoreInCell = std::uint32_t{1} << 31;

/// Linked cells to search, and what is found there. Heads are candidates with the images of their cells, or kEmpty.
struct CellsTask {
  const std::uint32_t* first = nullptr;   ///< the first cell of the sphere's row
  const HeadRows* rows = nullptr;         ///< rows to read: four cells of each
  const std::uint32_t* wanted = nullptr;  ///< a mask of these four cells; the fourth one is never wanted
  const CellLink* link = nullptr;         ///< by slot
  std::uint32_t away = 0;                 ///< the boxes of the sphere, as in HeadStep
  std::uint32_t self = 0;                 ///< the sphere as a candidate in its own box
  std::uint32_t own = kEmpty;             ///< a head that is left out of the last row, or kEmpty

  std::uint32_t* candidates = nullptr;  ///< the spheres found, padded with the sphere
  unsigned room = 0;                    ///< of the array; if it is less than count + 8, provide more and search again
  unsigned count = 0;
  unsigned same = 0;  ///< as in ScanTask
};

/// The faces of cells: cell c along axis k begins at origin[k] + c·edge[k] if lowest[k] < c < highest[k]; elsewhere,
/// and on axes that do not exist, there is no face.
struct CellFaces {
  double origin[4]{}, edge[4]{}, lowest[4]{}, highest[4]{};
};
struct Crossing {
  double after;   ///< time from the record to the crossing
  unsigned face;  ///< as in NextEvent
};

/// The kernels of one instruction set. Those for AVX-512 also scan four candidates at once.
struct ScanKernels {
  /// The first contact of a sphere with one of its candidates, by dimension − 2. `latest` states that no candidate's
  /// record has a later time than the sphere's.
  ScanResult (*scan[2])(const ScanSetting&, const ScanTask&, bool latest);
  /// Scans the two spheres of a collision: no candidate's record may have a later time than theirs.
  void (*scan_two[2])(const ScanSetting&, const ScanTask* task, ScanResult* result);
  /// The first contact or step of a sphere with at most kScanBlock candidates, all in plain pairs with the surfaces, by
  /// dimension − 2.
  StepScan (*scan_steps[2])(const ScanSetting&, const ScanTask&);
  /// Writes the slots of all spheres within the limit and the linear images of their cells; returns their number. The
  /// arrays must have room for all spheres in the cells.
  unsigned (*near)(const NearTask&, std::uint32_t* slots, std::int32_t* away);
  /// Compares n candidates with a list, which is read in blocks of eight: copies the candidates that are not in the
  /// list to `fresh`, returns their number, and sets a bit in `kept` (initially 0) for each list entry that is among
  /// the candidates.
  unsigned (*compare)(const std::uint32_t* list, unsigned length, const std::uint32_t* candidates, unsigned n,
                      std::uint32_t* fresh, std::uint64_t* kept);
  /// Writes the first sphere of each cell, as seen from the box of the sphere, with kMoreInCell; sets `count`.
  void (*heads)(CellsTask&);
  /// Finds all spheres in cells and the first contact with them, by dimension − 2. `latest` as for `scan`.
  ScanResult (*search[2])(const ScanSetting&, CellsTask&, bool latest);
  /// Finds where a sphere with this record leaves its cell, by dimension − 2; four numbers of the cell are read.
  Crossing (*crossing[2])(const CellFaces&, const double* record, const std::int32_t* cell);
};

}  // namespace carom
