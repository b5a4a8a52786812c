// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Cells for initial states, where spheres are inserted one by one and each must find its neighbours, also through
// periodic images. Spheres within a factor of two in size share a grid, so that small spheres get small cells. The
// cells of the event core are built for speed; these are built to be correct in any box.

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "engine/search/cell_grid.h"

namespace carom {

template <int D>
class PlacementGrid {
 public:
  /// For spheres of these radii, which must outlive the grid.
  PlacementGrid(const Box<D>& box, std::span<const double> radius) : radius_(radius) {
    largest_ = *std::max_element(radius.begin(), radius.end());
    std::array<std::size_t, kLevels> spheres{};
    for (const double r : radius) ++spheres[level(r)];
    for (int l = 0; l < kLevels; ++l)
      if (spheres[l] > 0) levels_[l].emplace(box, std::ldexp(largest_, -l), spheres[l]);
  }

  void insert(Id id, const Vec<D>& x) {
    Level& at = *levels_[level(radius_[id])];
    at.members[at.grid.index(cell(at.grid, x))].push_back(id);
  }

  /// Calls visit(id, shift) for every sphere that a sphere of this radius at x may touch (and for some more); the
  /// position of `id` plus `shift` is the image near x. x must be in the box on periodic axes.
  template <class Visit>
  void near(const Vec<D>& x, double radius, Visit&& visit) const {
    for (const auto& at : levels_) {
      if (!at) continue;
      Cell<D> range;
      for (int k = 0; k < D; ++k)
        range[k] = std::max(1, static_cast<int>(std::ceil((radius + at->largest) / at->grid.edge(k) - 1e-14)));
      at->grid.for_each_around(cell(at->grid, x), range, [&](std::size_t index, const Image<D>& away) {
        for (const Id id : at->members[index]) visit(id, at->grid.box().shift(away));
      });
    }
  }

 private:
  static constexpr int kLevels = 8;  // the last level has all smaller spheres

  /// The grid of one size. Its cells are at least a diameter wide (if the axis is long enough), and about as many as
  /// there are spheres.
  struct Level {
    Level(const Box<D>& box, double radius, std::size_t spheres)
        : largest(radius), grid(box, 2 * radius, {spheres, Vec<D>::Zero(), box.edges}), members(grid.cells()) {}
    double largest;
    CellGrid<D> grid;
    std::vector<std::vector<Id>> members;
  };

  /// The cell of a sphere in the box, even if rounding puts it on the edge.
  static Cell<D> cell(const CellGrid<D>& grid, const Vec<D>& x) {
    Cell<D> c = grid.cell(x);
    for (int k = 0; k < D; ++k) c[k] = std::clamp(c[k], 0, grid.count(k) - 1);
    return c;
  }

  int level(double radius) const { return std::min(std::ilogb(largest_ / radius), kLevels - 1); }

  const std::span<const double> radius_;
  double largest_ = 0;
  std::array<std::optional<Level>, kLevels> levels_;
};

}  // namespace carom
