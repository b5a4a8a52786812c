#pragma once
// A grid of cells for the making of initial states: spheres go in one by one and ask who is near, through periodic
// images too. The event core has cells of its own, built for speed; these are built for correctness in any box.

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "engine/box.h"

namespace carom {

template <int D>
class PlacementGrid {
 public:
  /// Cells no smaller than `reach` (along axes that are long enough), and about as many as there are spheres.
  PlacementGrid(const Box<D>& box, double reach, std::size_t spheres) : box_(box) {
    const double enough = std::ceil(std::pow(static_cast<double>(spheres), 1.0 / D)) + 1;
    std::size_t cells = 1;
    for (int k = 0; k < D; ++k) {
      count_[k] = std::max(1, static_cast<int>(std::min(std::floor(box.edges[k] / reach), enough)));
      cells *= static_cast<std::size_t>(count_[k]);
    }
    members_.resize(cells);
  }

  void insert(Id id, const Vec<D>& x) {
    std::size_t index = 0;
    for (int k = 0; k < D; ++k) index = index * count_[k] + cell(k, x[k]);
    members_[index].push_back(id);
  }

  /// Calls visit(id, shift) for everybody in this and the neighbouring cells; id's position plus shift is the image
  /// that is near x. x lies in the box on periodic axes.
  template <class Visit>
  void near(const Vec<D>& x, Visit&& visit) const {
    visit_axis(x, 0, 0, Vec<D>::Zero(), visit);
  }

 private:
  int cell(int axis, double x) const {
    return std::clamp(static_cast<int>(std::clamp(std::floor(x / box_.edges[axis] * count_[axis]), -1e9, 1e9)), 0,
                      count_[axis] - 1);
  }

  template <class Visit>
  void visit_axis(const Vec<D>& x, int axis, std::size_t index, Vec<D> shift, Visit& visit) const {
    if (axis == D) {
      for (const Id id : members_[index]) visit(id, shift);
      return;
    }
    const int n = count_[axis], here = cell(axis, x[axis]);
    for (int c = here - 1; c <= here + 1; ++c) {
      int wrapped = c;
      shift[axis] = 0;
      if (c < 0 || c >= n) {
        if (!box_.periodic(axis)) continue;
        wrapped = c < 0 ? c + n : c - n;
        shift[axis] = c < 0 ? -box_.edges[axis] : box_.edges[axis];
      }
      visit_axis(x, axis + 1, index * n + wrapped, shift, visit);
    }
  }

  const Box<D>& box_;
  std::array<int, D> count_{};
  std::vector<std::vector<Id>> members_;
};

}  // namespace carom
