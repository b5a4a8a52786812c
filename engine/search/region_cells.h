// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The cells of skin_lists.h for spheres of similar size: in which the centres of their regions stand, and which are
// near a place.
//
// A cell has a cache line for eight spheres, with their places in ten bits an axis, and further lines where it holds
// more. Places are rounded down, so that all spheres within a distance are found, and some that are a little farther.

#include <limits>
#include <span>
#include <vector>

#include "engine/base/pages.h"
#include "engine/base/record.h"
#include "engine/search/cell_grid.h"
#include "engine/search/simd/scan.h"

namespace carom {

template <int D>
class RegionCells {
 public:
  /// For about so many spheres in the whole system, that see each other within `reach`; no find() will look farther
  /// than `farthest`. clear() before anything else but confine().
  RegionCells(const Box<D>& box, const Packing<D>& packing, const ScanKernels& kernels, const Extent<D>& extent,
              double spheres, double reach, double farthest);

  /// Only cells close to these places are stored: see insert().
  void confine(std::span<const Vec<D>> places);
  /// Takes confine() back. Returns the spheres in the cells, which are empty now.
  std::vector<Slot> spread();
  /// Empties all cells.
  void clear();
  /// Boxes that find() looks away from the cell of a place at most.
  std::int32_t widest() const { return widest_; }

  /// Puts a sphere into the cell of a place, which lies in `boxes`; false: that cell is not stored, spread() first.
  bool insert(Slot i, const Vec<D>& x, Image<D>& boxes);
  void remove(Slot i, const Vec<D>& x);

  struct Found {
    std::span<const Slot> slots;
    const std::int32_t* away;  ///< of each: the boxes its cell is away from that of the place, as a linear image
    std::int32_t boxes;        ///< in which the latter lies
  };
  /// The spheres within a distance of x; each image for itself. Good until the next call.
  Found find(const Vec<D>& x, double reach);

 private:
  struct Located {
    Vec<D> x = Vec<D>::Constant(std::numeric_limits<double>::quiet_NaN());
    Cell<D> cell{};
    Image<D> boxes{};
    std::array<std::int32_t, D> place{};  // in 1024ths of a cell
  };

  static double edge(const Box<D>& box, const Extent<D>& extent, double spheres, double reach);
  static double rounded(double reach);
  const Located& locate(const Vec<D>& x);

  Packing<D> packing_;
  const ScanKernels& kernels_;
  CellGrid<D> grid_;
  PageVector<CellLine> lines_;
  std::vector<std::uint32_t> next_;  // by line
  std::uint32_t free_ = kEmpty;
  std::int32_t margin_ = 1;                     // cells that the farthest reach extends beyond one's own
  std::array<std::vector<CellStep>, D> steps_;  // by axis: to the cells −margin … count + margin
  std::int32_t widest_ = 0;
  Located located_;  // the last place: a sphere is inserted, and what is near it found

  std::array<std::vector<CellView>, D> views_;
  std::vector<Slot> slots_;
  std::vector<std::int32_t> away_;
};

}  // namespace carom
