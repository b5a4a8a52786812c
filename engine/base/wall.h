// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A hard, elastic wall of the box: a plane normal to an axis, with everything a contact with it needs. A wall that
// moves at a constant speed u is a piston: a collision turns the normal velocity v of a sphere into 2u − v.

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "engine/base/vec.h"

namespace carom {

template <int D>
struct Wall {
  int axis = 0;
  double inward = 1;    ///< unit normal along the axis: 1 for a lower wall, −1 for an upper one
  double position = 0;  ///< along the axis at time 0, the start of the slab [length]
  double velocity = 0;  ///< along the normal [length/time]

  /// The number in event keys and files: 2·axis for a lower wall, 2·axis + 1 for an upper one.
  Id number() const { return static_cast<Id>(2 * axis + (inward > 0 ? 0 : 1)); }
  Vec<D> normal() const { return inward * Vec<D>::Unit(axis); }
  double along_normal(const Vec<D>& v) const { return inward * v[axis]; }
  double at(double t) const { return position + inward * velocity * t; }
  /// The gap between the wall and a sphere at x at time t [length].
  double gap(const Vec<D>& x, double radius, double t = 0) const {
    return inward > 0 ? x[axis] - at(t) - radius : at(t) - radius - x[axis];
  }
  /// The rate at which the gap of a sphere with velocity v grows.
  double opening(const Vec<D>& v) const { return along_normal(v) - velocity; }
  /// The component along the axis after the collision of a sphere with a radius that grows at `rate`; v is the
  /// component before it.
  double reflected(double v, double rate = 0) const { return inward * (2 * (velocity + rate)) - v; }
  /// The work that this impulse does on a sphere [energy].
  double work(const Vec<D>& impulse) const { return velocity * along_normal(impulse); }
  /// The point that a sphere at x touches at time t.
  Vec<D> foot(Vec<D> x, double t = 0) const {
    x[axis] = at(t);
    return x;
  }
};

/// The axis of the wall with this number, and its name in messages: "the upper wall of axis 1".
inline int wall_axis(Id number) { return static_cast<int>(number / 2); }
inline std::string wall_name(Id number) {
  const std::string side = number % 2 == 0 ? "the lower" : "the upper";
  return side + " wall of axis " + std::to_string(number / 2);
}

/// The tolerance below which a gap counts as touching: max(1e-13 contact distances, 4 ulp of the box) [length].
class GapTolerance {
 public:
  explicit GapTolerance(double largest_edge)
      : least_(4 * (std::nextafter(largest_edge, std::numeric_limits<double>::infinity()) - largest_edge)) {}
  /// `sigma`: the contact distance; for a sphere and a wall it is the radius.
  double operator()(double sigma) const { return std::max(1e-13 * sigma, least_); }

 private:
  double least_;
};

}  // namespace carom
