// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A regular grid of search cells over the box.
//
// Positions are mapped to *unwrapped* integer cells: a position outside a periodic box, or an image of one, has cell
// numbers of its own there, and the difference of two unwrapped cells gives the image of a neighbour. (The nearest
// image of two positions is wrong if the box is dilute or small.) Along open and walled axes the outermost cells extend
// to infinity. If the lattice of images is tilted (Box::tilt), the boxes above and below the first row of boxes are
// displaced along the first axis, and so are their cells. Only the search uses the cells: results never depend on them.

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <vector>

#include "engine/base/elementary.h"
#include "engine/laws/box.h"

namespace carom {

template <int D>
using Cell = std::array<std::int32_t, D>;

/// The number and the bounds of the particles for which a grid is made.
template <int D>
struct Extent {
  std::size_t particles = 0;
  Vec<D> low = Vec<D>::Zero(), high = Vec<D>::Zero();  ///< bounds of the positions

  Extent() = default;
  explicit Extent(std::span<const Vec<D>> x) {
    for (const Vec<D>& p : x) add(p);
  }
  Extent(std::size_t n, const Vec<D>& from, const Vec<D>& to) : particles(n), low(from), high(to) {}
  void add(const Vec<D>& x) {
    low = particles == 0 ? x : low.cwiseMin(x).eval();
    high = particles == 0 ? x : high.cwiseMax(x).eval();
    ++particles;
  }
};

template <int D>
class CellGrid {
 public:
  /// Makes cells of edge at least `smallest` over the box (along open axes: over the positions), and not many more than
  /// `cells_a_particle` of them per particle; then each is divided into `slices` cells along the last axis.
  CellGrid(const Box<D>& box, double smallest, const Extent<D>& extent, double cells_a_particle = 2, int slices = 1)
      : box_(box) {
    const double most =
        std::max(1.0, std::floor(elementary::pow(cells_a_particle * static_cast<double>(extent.particles), 1.0 / D)));
    for (int k = 0; k < D; ++k) {
      const bool open = !box.bounded(k);
      const double low = open ? extent.low[k] : 0, high = open ? extent.high[k] : box.edges[k];
      const double length = box.periodic(k) ? high - low : std::max(high - low, smallest);
      // 1e-9 is a margin: rounding must never make a cell smaller than `smallest`.
      count_[k] = static_cast<std::int32_t>(std::clamp(std::floor(length / (smallest * (1 + 1e-9))), 1.0, most));
      if (k == D - 1) count_[k] *= slices;
      origin_[k] = low;
      edge_[k] = length / count_[k];
      inverse_[k] = 1 / edge_[k];
    }
    lay_out();
  }

  /// The number of stored cells.
  std::size_t cells() const {
    std::size_t n = 1;
    for (int k = 0; k < D; ++k) n *= static_cast<std::size_t>(rows(k));
    return n;
  }
  int count(int axis) const { return count_[axis]; }
  double edge(int axis) const { return edge_[axis]; }
  double inverse_edge(int axis) const { return inverse_[axis]; }
  const Box<D>& box() const { return box_; }

  /// The unwrapped cell of a position.
  Cell<D> cell(const Vec<D>& x) const {
    Cell<D> c;
    for (int k = 0; k < D; ++k) c[k] = cell(k, x[k]);
    if (box_.tilt != 0) c[0] = cell(0, upright(x[0], boxes(1, c[1])));
    return c;
  }
  std::int32_t cell(int axis, double x) const {
    double at = std::floor((x - origin_[axis]) * inverse_[axis]);
    if (!box_.periodic(axis)) at = std::clamp(at, 0.0, count_[axis] - 1.0);
    return static_cast<std::int32_t>(at);
  }
  /// A coordinate along the first axis, in a row of boxes, relative to the displacement of this row.
  double upright(double x, std::int32_t row) const { return x - row * box_.tilt; }

  /// The coordinate of the lower face of unwrapped cell number c on an axis.
  double face(int axis, std::int32_t c) const { return origin_[axis] + c * edge_[axis]; }

  /// The index at which an unwrapped cell is stored.
  std::size_t index(const Cell<D>& c) const {
    std::size_t at = 0;
    for (int k = 0; k < D; ++k) at += stride_[k] * static_cast<std::size_t>(row(k, wrapped(k, c[k])));
    return at;
  }

  /// Stores separately only the cells that are, along each of the first `axes` axes, at most `margin` cells from one of
  /// these positions. All other cells share storage that must stay empty: see holds().
  void confine(std::span<const Vec<D>> places, std::int32_t margin, int axes = D) {
    for (int k = 0; k < axes; ++k) {
      std::vector<std::int32_t>& row = row_[k];
      row.assign(static_cast<std::size_t>(count_[k]), 0);
      for (const Vec<D>& x : places) row[static_cast<std::size_t>(wrapped(k, cell(x)[k]))] = 1;
      const std::vector<std::int32_t> inside = row;
      for (std::int32_t c = 0; c < count_[k]; ++c)
        for (std::int32_t m = -margin; m <= margin && inside[static_cast<std::size_t>(c)] != 0; ++m)
          if (Step to; step(k, c + m, to)) row[static_cast<std::size_t>(wrapped(k, c + m))] = 1;
      rows_[k] = 0;
      for (std::int32_t& r : row) r = r != 0 ? rows_[k]++ : -1;
      if (rows_[k] + 1 >= count_[k]) row.clear();  // the row for all others would save nothing
      if (!row.empty()) std::replace(row.begin(), row.end(), -1, rows_[k]);
    }
    lay_out();
  }
  /// Whether something may be stored in an unwrapped cell.
  bool holds(const Cell<D>& c) const {
    for (int k = 0; k < D; ++k)
      if (!row_[k].empty() && row(k, wrapped(k, c[k])) == rows_[k]) return false;
    return true;
  }
  /// Undoes confine().
  void spread() {
    for (auto& row : row_) row.clear();
    lay_out();
  }
  /// The row in which cell 0 … count - 1 of an axis is stored, and the number of rows along this axis, which is less
  /// than count() if the cells are confined.
  std::int32_t row(int axis, std::int32_t c) const {
    return row_[axis].empty() ? c : row_[axis][static_cast<std::size_t>(c)];
  }
  std::int32_t rows(int axis) const { return row_[axis].empty() ? count_[axis] : rows_[axis] + 1; }

  /// The number of boxes between an unwrapped cell and the box that holds the origin.
  std::int32_t boxes(int axis, std::int32_t c) const {
    return c >= 0 && c < count_[axis] ? 0 : (c - wrapped(axis, c)) / count_[axis];
  }
  Image<D> boxes(const Cell<D>& c) const {
    Image<D> image;
    for (int k = 0; k < D; ++k) image[k] = boxes(k, c[k]);
    return image;
  }

  /// What one axis adds to index(), and the number of boxes that the cell is away.
  struct Step {
    std::size_t offset;
    std::int32_t boxes;
  };
  /// The step to unwrapped cell number c; false if this cell does not exist because it is beyond a wall or an open end.
  bool step(int axis, std::int32_t c, Step& to) const {
    const bool inside = c >= 0 && c < count_[axis];
    if (!inside && !box_.periodic(axis)) return false;
    const std::int32_t w = wrapped(axis, c);
    to = {stride_[axis] * static_cast<std::size_t>(row(axis, w)), inside ? 0 : (c - w) / count_[axis]};
    return true;
  }

  /// How many cells away along each axis a position within `reach` [length] may be.
  Cell<D> range(double reach) const {
    Cell<D> range;
    for (int k = 0; k < D; ++k)
      range[k] = static_cast<std::int32_t>(std::clamp(std::ceil(reach / edge_[k]), 1.0, kLargestRange));
    return range;
  }

  /// Calls visit(first, end, boxes) for all cells within `range` cells of `centre` and for each of their images, in
  /// ranges along the last axis: the cells have the indices from `first` to `end` − 1 and are `boxes` boxes away. No
  /// cells exist beyond walls and open ends. `half`: only for the centre, which is the first cell of all, and for the
  /// cells after it in the order of unwrapped cells, so that each pair of cells comes once. Not after confine().
  /// (It is inlined by force, because the compiler would otherwise call it, which makes lists of neighbours slower.)
  template <class Visit>
  [[gnu::always_inline]] void for_each_range(const Cell<D>& centre, const Cell<D>& range, bool half,
                                             Visit&& visit) const {
    constexpr int last = D - 1;
    Cell<D> low, high;
    for (int k = 0; k < D; ++k) {
      low[k] = centre[k] - range[k], high[k] = centre[k] + range[k];
      if (!box_.periodic(k)) low[k] = std::max(low[k], 0), high[k] = std::min(high[k], count_[k] - 1);
    }
    if (box_.tilt != 0) [[unlikely]]
      return for_each_range_tilted(centre, low, high, half, visit);
    Image<D> boxes;
    const auto offset = [&](int k, std::int32_t c) {
      boxes[k] = this->boxes(k, c);
      return stride_[k] * static_cast<std::size_t>(c - boxes[k] * count_[k]);
    };
    for (std::int32_t a = half ? centre[0] : low[0]; a <= high[0]; ++a) {
      const std::size_t first = offset(0, a);
      const bool upper = half && a == centre[0];
      for (std::int32_t b = D == 2 || upper ? centre[1] : low[1]; b <= (D == 2 ? centre[1] : high[1]); ++b) {
        const std::size_t row = D == 2 ? first : first + offset(1, b);
        std::int32_t c = upper && b == centre[1] ? centre[last] : low[last];
        for (std::int32_t end; c <= high[last]; c = end) {
          const std::size_t begin = row + offset(last, c);
          end = std::min(high[last] + 1, (boxes[last] + 1) * count_[last]);
          visit(begin, begin + static_cast<std::size_t>(end - c), boxes);
        }
      }
    }
  }

  /// Moves to the next cell in the order of index(), and from the last one to the first.
  void advance(Cell<D>& cell) const {
    for (int k = D - 1; k >= 0 && ++cell[k] == count_[k]; --k) cell[k] = 0;
  }

 private:
  static constexpr double kLargestRange = 1e8;  // cells

  /// for_each_range() in a tilted lattice. A pair of cells comes once with `half`, which is in the order of the second,
  /// first and third axis here: the cells of one row of boxes are not displaced relative to each other.
  template <class Visit>
  [[gnu::noinline]] void for_each_range_tilted(const Cell<D>& centre, const Cell<D>& low, const Cell<D>& high,
                                               bool half, Visit& visit) const {
    const std::int32_t own = boxes(1, centre[1]);
    for (std::int32_t b = half ? centre[1] : low[1]; b <= high[1]; ++b) {
      Cell<D> at;
      at[1] = b;
      const double away = -(boxes(1, b) - own) * box_.tilt * inverse_[0];  // of the centre, as seen in this row [cell]
      const auto down = static_cast<std::int32_t>(std::floor(away)), up = static_cast<std::int32_t>(std::ceil(away));
      const bool same = half && b == centre[1];
      for (std::int32_t a = same ? centre[0] : low[0] + down; a <= high[0] + up; ++a) {
        at[0] = a;
        const auto look = [&] {
          const std::size_t cell = index(at);
          visit(cell, cell + 1, boxes(at));
        };
        if constexpr (D == 2)
          look();
        else
          for (at[2] = same && a == centre[0] ? centre[2] : low[2]; at[2] <= high[2]; ++at[2]) look();
      }
    }
  }

  std::int32_t wrapped(int axis, std::int32_t c) const {
    if (!box_.periodic(axis) || (c >= 0 && c < count_[axis])) return c;
    const std::int32_t r = c % count_[axis];
    return r < 0 ? r + count_[axis] : r;
  }

  void lay_out() {
    stride_[D - 1] = 1;
    for (int k = D - 1; k > 0; --k) stride_[k - 1] = stride_[k] * static_cast<std::size_t>(rows(k));
  }

  Box<D> box_;
  Cell<D> count_;
  std::array<std::vector<std::int32_t>, D> row_;  // by axis and cell, if confined; if empty, the cell's own number
  Cell<D> rows_{};                                // stored rows if confined; one more row is empty
  std::array<std::size_t, D> stride_;
  Vec<D> origin_, edge_, inverse_;
};

}  // namespace carom
