// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The cells of skin_lists.h for spheres of similar size: they store the centres of the spheres' regions and find the
// centres near a position.
//
// A cell has a cache line for eight spheres, with positions of ten bits per axis, and further lines if it holds more.
// Positions are rounded down; find() returns all spheres within a distance and some that are a little farther.

#include <limits>
#include <span>
#include <vector>

#include "engine/base/pages.h"
#include "engine/base/record.h"
#include "engine/search/cell_grid.h"
#include "engine/search/flow_frame.h"
#include "engine/search/simd/scan.h"

namespace carom {

template <int D>
class RegionCells {
 public:
  /// For about `spheres` spheres in the whole system with interaction range `reach`; `farthest` is the largest reach of
  /// find(). Call clear() before any other function except confine().
  RegionCells(const Box<D>& box, const Packing<D>& packing, const ScanKernels& kernels, const Extent<D>& extent,
              double spheres, double reach, double farthest);

  /// Stores only cells close to these positions: see insert().
  void confine(std::span<const Vec<D>> places);
  /// Undoes confine() and empties all cells. Returns the spheres that were in them.
  std::vector<Slot> spread();
  /// Empties all cells.
  void clear();
  /// The largest number of boxes between a position's cell and the cells that find() reads.
  std::int32_t widest() const { return widest_; }

  /// Inserts a sphere into the cell of a position, which is in box `boxes`; returns false if this cell is not stored:
  /// call spread() first.
  bool insert(Slot i, const Vec<D>& x, Image<D>& boxes);
  void remove(Slot i, const Vec<D>& x);

  struct Found {
    std::span<const Slot> slots;
    const std::int32_t* away;  ///< by sphere: the boxes between its cell and the position's, as a linear image
    std::int32_t boxes;        ///< the box of the position, as a linear image
  };
  /// The spheres within a distance of x, at some strain of a flow, once for each image. Valid until the next call.
  Found find(const Vec<D>& x, double reach, const FlowFrame& flow = {});

 private:
  struct Located {
    Vec<D> x = Vec<D>::Constant(std::numeric_limits<double>::quiet_NaN());
    Cell<D> cell{};
    Image<D> boxes{};
    std::array<std::int32_t, D> place{};  // in 1024ths of a cell
  };

  std::size_t look_along(int axis, std::int32_t here, std::int32_t place, double reach, std::int32_t away);
  static double edge(const Box<D>& box, const Extent<D>& extent, double spheres, double reach);
  static double rounded(double reach);
  const Located& locate(const Vec<D>& x);
  std::int32_t place_in(int axis, double x, std::int32_t cell) const;

  Packing<D> packing_;
  const ScanKernels& kernels_;
  CellGrid<D> grid_;
  PageVector<CellLine> lines_;
  std::vector<std::uint32_t> next_;  // by line
  std::uint32_t free_ = kEmpty;
  std::int32_t margin_ = 1;                     // cells by which the farthest reach extends beyond a sphere's own
  std::array<std::vector<CellStep>, D> steps_;  // by axis: to the cells −margin … count + margin
  std::int32_t widest_ = 0;
  Located located_;  // the last position: it is used to insert a sphere and then to find its neighbours

  std::array<std::vector<CellView>, D> views_;
  std::vector<Slot> slots_;
  std::vector<std::int32_t> away_;
};

}  // namespace carom
