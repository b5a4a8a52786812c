// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Cells for the making of initial states: spheres are inserted one by one, and each finds those near it, through
// periodic images too. Spheres of a size (up to a factor of two) share a grid, so that small ones don't have the cells
// of large ones. The event core has cells of its own, built for speed; these are built for correctness in any box.

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
  /// For spheres of these radii, which outlive the grid.
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

  /// Calls visit(id, shift) for every sphere that one of this radius at x may touch (and for some more); id's position
  /// plus shift is the image that is near x. x lies in the box on periodic axes.
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
  static constexpr int kLevels = 8;  // the last holds all that is smaller

  /// The grid of one size. Cells are no smaller than a diameter (along axes that are long enough), and about as many as
  /// there are spheres.
  struct Level {
    Level(const Box<D>& box, double radius, std::size_t spheres)
        : largest(radius), grid(box, 2 * radius, {spheres, Vec<D>::Zero(), box.edges}), members(grid.cells()) {}
    double largest;
    CellGrid<D> grid;
    std::vector<std::vector<Id>> members;
  };

  /// That of a sphere in the box, also where rounding takes it to the edge.
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
