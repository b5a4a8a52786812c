#pragma once
// How the box is divided among regions: by recursive bisection, so that each has about as many spheres.
//
// Which region owns a sphere never reaches the physics; all that matters is that everybody computes the same.

#include <algorithm>
#include <limits>
#include <span>
#include <vector>

#include "engine/box.h"

namespace carom {

template <int D>
class Division {
 public:
  /// Regions for spheres at x.
  Division(const Box<D>& box, std::span<const Vec<D>> x, std::size_t regions);

  /// The region that a place belongs to, in whatever box it is.
  std::uint32_t owner(const Vec<D>& x) const;
  /// Calls visit(region) for all regions that a place is nearer to than `reach`, its own among them.
  template <class Visit>
  void for_each_near(const Vec<D>& x, double reach, Visit&& visit) const {
    const Vec<D> at = wrapped(x);
    for (std::uint32_t r = 0; r < parts_.size(); ++r)
      if (squared_distance(parts_[r], at) <= reach * reach) visit(r);
  }
  bool near(std::uint32_t region, const Vec<D>& x, double reach) const {
    return squared_distance(parts_[region], wrapped(x)) <= reach * reach;
  }
  /// How far a place in a region is from its faces; infinite where it has none.
  double depth(std::uint32_t region, const Vec<D>& x) const;
  /// The regions that are nearer than `reach` to a region, without itself.
  std::vector<std::uint32_t> neighbours(std::uint32_t region, double reach) const;

 private:
  struct Part {
    Vec<D> low = Vec<D>::Zero(), high = Vec<D>::Zero();     // infinite where the box has a wall or an open end
    Vec<D> centre = Vec<D>::Zero(), half = Vec<D>::Zero();  // along periodic axes
  };
  struct Cut {
    int axis;
    double at;
    std::int32_t below, above;  // a further cut, or ~region
  };

  std::int32_t divide(std::span<Vec<D>> x, Part part, std::size_t regions);
  Vec<D> wrapped(Vec<D> x) const {
    for (int k = 0; k < D; ++k) {
      if (!box_.periodic(k) || (x[k] >= 0 && x[k] < box_.edges[k])) continue;
      x[k] -= std::floor(x[k] / box_.edges[k]) * box_.edges[k];
      if (!(x[k] >= 0 && x[k] < box_.edges[k])) x[k] = 0;
    }
    return x;
  }
  double squared_distance(const Part& part, const Vec<D>& x) const {
    double sum = 0;
    for (int k = 0; k < D; ++k) {
      double d = 0;
      if (box_.periodic(k)) {
        const double away = std::abs(x[k] - part.centre[k]);
        d = std::max(std::min(away, box_.edges[k] - away) - part.half[k], 0.0);
      } else {
        d = std::max({part.low[k] - x[k], x[k] - part.high[k], 0.0});
      }
      sum += d * d;
    }
    return sum;
  }
  double gap(int axis, double low, double high, double other_low, double other_high) const;

  Box<D> box_;
  std::vector<Part> parts_;
  std::vector<Cut> cuts_;
  std::int32_t root_ = 0;
};

}  // namespace carom
