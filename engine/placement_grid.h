#pragma once
// Cells for the making of initial states: spheres are inserted one by one, and each finds those near it, through
// periodic images too. Spheres of a size (up to a factor of two) share a grid, so that small ones don't have the cells
// of large ones. The event core has cells of its own, built for speed; these are built for correctness in any box.

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "engine/box.h"

namespace carom {

template <int D>
class PlacementGrid {
 public:
  /// For spheres of these radii, which outlive the grid.
  PlacementGrid(const Box<D>& box, std::span<const double> radius) : box_(box), radius_(radius) {
    largest_ = *std::max_element(radius.begin(), radius.end());
    std::array<std::size_t, kLevels> spheres{};
    for (const double r : radius) ++spheres[level(r)];
    for (int l = 0; l < kLevels; ++l)
      if (spheres[l] > 0) levels_[l] = Level(box, std::ldexp(largest_, -l), spheres[l]);
  }

  void insert(Id id, const Vec<D>& x) {
    Level& at = levels_[level(radius_[id])];
    std::size_t index = 0;
    for (int k = 0; k < D; ++k) index = index * at.count[k] + cell(at, k, x[k]);
    at.members[index].push_back(id);
  }

  /// Calls visit(id, shift) for every sphere that one of this radius at x may touch (and for some more); id's position
  /// plus shift is the image that is near x. x lies in the box on periodic axes.
  template <class Visit>
  void near(const Vec<D>& x, double radius, Visit&& visit) const {
    for (const Level& at : levels_)
      if (!at.members.empty()) visit_axis(at, x, radius + at.largest, 0, 0, Vec<D>::Zero(), visit);
  }

 private:
  static constexpr int kLevels = 8;  // the last holds all that is smaller

  /// The grid of one size. Cells are no smaller than a diameter (along axes that are long enough), and about as many as
  /// there are spheres.
  struct Level {
    Level() = default;
    Level(const Box<D>& box, double radius, std::size_t spheres) : largest(radius) {
      const double enough = std::ceil(std::pow(static_cast<double>(spheres), 1.0 / D)) + 1;
      std::size_t cells = 1;
      for (int k = 0; k < D; ++k) {
        count[k] = std::max(1, static_cast<int>(std::min(std::floor(box.edges[k] / (2 * radius)), enough)));
        cells *= static_cast<std::size_t>(count[k]);
      }
      members.resize(cells);
    }
    double largest = 0;
    std::array<int, D> count{};
    std::vector<std::vector<Id>> members;
  };

  int level(double radius) const { return std::min(std::ilogb(largest_ / radius), kLevels - 1); }

  int cell(const Level& at, int axis, double x) const {
    return std::clamp(static_cast<int>(std::clamp(std::floor(x / box_.edges[axis] * at.count[axis]), -1e9, 1e9)), 0,
                      at.count[axis] - 1);
  }

  template <class Visit>
  void visit_axis(const Level& at, const Vec<D>& x, double reach, int axis, std::size_t index, Vec<D> shift,
                  Visit& visit) const {
    if (axis == D) {
      for (const Id id : at.members[index]) visit(id, shift);
      return;
    }
    const int n = at.count[axis], here = cell(at, axis, x[axis]);
    const bool periodic = box_.periodic(axis);
    const double range = std::max(1.0, std::ceil(reach / box_.edges[axis] * n - 1e-14));  // in cells
    const int cells = static_cast<int>(periodic ? range : std::min<double>(range, n));
    for (int c = here - cells; c <= here + cells; ++c) {
      if (!periodic && (c < 0 || c >= n)) continue;
      const int boxes = c >= 0 ? c / n : -((n - 1 - c) / n);
      shift[axis] = boxes * box_.edges[axis];
      visit_axis(at, x, reach, axis + 1, index * n + (c - boxes * n), shift, visit);
    }
  }

  const Box<D>& box_;
  const std::span<const double> radius_;
  double largest_ = 0;
  std::array<Level, kLevels> levels_;
};

}  // namespace carom
