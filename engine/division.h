#pragma once
// How the box is divided among regions: by recursive bisection, so that each has about as many spheres.
//
// Which region owns a sphere never reaches the physics; all that matters is that everybody computes the same.

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

  std::size_t size() const { return parts_.size(); }
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
  /// The regions that are nearer than `reach` to a region, without itself.
  std::vector<std::uint32_t> neighbours(std::uint32_t region, double reach) const;

 private:
  struct Part {
    Vec<D> low, high;  // infinite where the box has a wall or an open end
  };
  struct Cut {
    int axis;
    double at;
    std::int32_t below, above;  // a further cut, or ~region
  };

  std::int32_t divide(std::span<Vec<D>> x, Part part, std::size_t regions);
  Vec<D> wrapped(Vec<D> x) const;
  double squared_distance(const Part& part, const Vec<D>& x) const;
  double gap(int axis, double low, double high, double other_low, double other_high) const;

  Box<D> box_;
  std::vector<Part> parts_;
  std::vector<Cut> cuts_;
  std::int32_t root_ = 0;
};

}  // namespace carom
