// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A hard, elastic wall of the box: a plane with a normal along an axis, and all that contacts with it need to know. It
// may move at a constant speed u, a piston: then a collision turns the normal velocity v of a sphere into 2u − v.

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "engine/base/vec.h"

namespace carom {

template <int D>
struct Wall {
  int axis = 0;
  double inward = 1;    ///< the unit normal along its axis: 1 at a lower wall, −1 at an upper one
  double position = 0;  ///< along the axis, at time 0: the start of the slab [length]
  double velocity = 0;  ///< along the normal [length/time]

  /// Its place in event keys and files: 2·axis, and one more at an upper wall.
  Id number() const { return static_cast<Id>(2 * axis + (inward > 0 ? 0 : 1)); }
  Vec<D> normal() const { return inward * Vec<D>::Unit(axis); }
  double along_normal(const Vec<D>& v) const { return inward * v[axis]; }
  double at(double t) const { return position + inward * velocity * t; }
  /// Between the wall and a sphere that is at x at time t [length].
  double gap(const Vec<D>& x, double radius, double t = 0) const {
    return inward > 0 ? x[axis] - at(t) - radius : at(t) - radius - x[axis];
  }
  /// The rate at which that grows, for a sphere with velocity v.
  double opening(const Vec<D>& v) const { return along_normal(v) - velocity; }
  /// What becomes of the component v, along the axis, of the velocity of a sphere of which the radius grows at `rate`.
  double reflected(double v, double rate = 0) const { return inward * (2 * (velocity + rate)) - v; }
  /// Done on a sphere that is given this impulse [energy].
  double work(const Vec<D>& impulse) const { return velocity * along_normal(impulse); }
  /// The point that a sphere at x touches at time t.
  Vec<D> foot(Vec<D> x, double t = 0) const {
    x[axis] = at(t);
    return x;
  }
};

/// The axis of the wall of that number, and what messages call it: "the upper wall of axis 1".
inline int wall_axis(Id number) { return static_cast<int>(number / 2); }
inline std::string wall_name(Id number) {
  const std::string side = number % 2 == 0 ? "the lower" : "the upper";
  return side + " wall of axis " + std::to_string(number / 2);
}

/// Gaps smaller than this count as touching: max(1e-13 contact distances, 4 ulp of the box) [length].
class GapTolerance {
 public:
  explicit GapTolerance(double largest_edge)
      : least_(4 * (std::nextafter(largest_edge, std::numeric_limits<double>::infinity()) - largest_edge)) {}
  /// The contact distance of a sphere and a wall is its radius.
  double operator()(double sigma) const { return std::max(1e-13 * sigma, least_); }

 private:
  double least_;
};

}  // namespace carom
