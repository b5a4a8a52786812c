// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A hard wall: a plane, a sphere or a cylinder, with everything a contact with it needs. box.h makes the list of all
// walls.
//
// A wall at normal·x = level(t) acts on the spheres on the side that its normal points to. In a slab it moves on a
// parabola; in free flight, where slabs are long, a shaken wall adds a sine. A one-way wall reflects a sphere at the
// moment at which it comes from being wholly in front; all other spheres pass, and one that turns back before it is
// through leaves as it came. A collision turns the velocity v of a sphere along the normal into 2u − v, where u is the
// velocity of the wall.
//
// A round wall, a sphere or a cylinder, acts on spheres inside or outside of it and does not move. At a contact it is
// the plane that touches it there: `at(x)`.

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "engine/base/normal_deviates.h"
#include "engine/base/vec.h"

namespace carom {

template <int D>
struct Wall {
  Id number = 0;  ///< in event keys and files: 2·axis for the lower face of the box, 2·axis + 1 for the upper one, 2·D
                  ///< and more for further walls
  int axis = -1;                   ///< a face of the box is normal to this axis; −1: a further wall
  Vec<D> normal = Vec<D>::Zero();  ///< unit vector of a plane, into the space of the spheres
  bool one_sided = true;           ///< false: does not act on spheres whose centres are behind the plane
  bool one_way = false;            ///< acts only on spheres that are wholly in front; others pass
  double depth = 0;         ///< one_way: a sphere that is deeper in the plane by rounding still counts as in front
  double offset = 0;        ///< level at time 0, the start of the slab [length]
  double velocity = 0;      ///< along the normal, at time 0 [length/time]
  double acceleration = 0;  ///< along the normal [length/time²]
  double amplitude = 0;     ///< amplitude of the sine; 0: no sine [length]
  double frequency = 0;     ///< frequency of the sine [1/time]
  double turns = 0;         ///< phase of the sine at time 0, in turns
  double temperature = 0;   ///< a thermal wall has one [energy]; 0: the wall is not thermal
  std::uint64_t seed = 1;   ///< seed of the random numbers of a thermal wall
  double round = 0;         ///< the radius of a wall that is a sphere or cylinder; 0: it is a plane [length]
  bool inside = true;       ///< the spheres are inside a round wall; false: outside
  Vec<D> centre = Vec<D>::Zero();     ///< of a round wall; of a cylinder: any point of its axis [length]
  Vec<D> direction = Vec<D>::Zero();  ///< unit vector along a cylinder; zero: a sphere

  double along_normal(const Vec<D>& v) const { return axis >= 0 ? normal[axis] * v[axis] : normal.dot(v); }
  double level(double t) const {
    const double smooth = offset + t * (velocity + 0.5 * t * acceleration);
    return amplitude == 0 ? smooth : smooth + amplitude * cosine_and_sine(turns + frequency * t)[1];
  }
  double velocity_at(double t) const {
    const double smooth = velocity + t * acceleration;
    return amplitude == 0 ? smooth : smooth + speed() * cosine_and_sine(turns + frequency * t)[0];
  }
  /// The largest speed of the sine.
  double speed() const { return 2 * std::numbers::pi * frequency * amplitude; }
  /// The gap between the wall and a sphere at x at time t; infinite if the wall does not act on the sphere [length].
  double gap(const Vec<D>& x, double radius, double t = 0) const {
    if (round > 0) [[unlikely]]
      return inside ? reach(radius) - from_centre(x).norm() : from_centre(x).norm() - reach(radius);
    const double at = level(t);
    if (axis >= 0) return normal[axis] > 0 ? x[axis] - at - radius : -at - radius - x[axis];
    const double distance = normal.dot(x) - at;
    if (one_way) return distance > radius - depth ? distance - radius : std::numeric_limits<double>::infinity();
    return one_sided || distance > 0 ? distance - radius : std::numeric_limits<double>::infinity();
  }
  /// The distance of the sphere's surface from the plane, negative for a sphere that is not wholly in front [length].
  double clearance(const Vec<D>& x, double radius, double t = 0) const { return normal.dot(x) - level(t) - radius; }
  /// The rate at which the gap of a sphere with velocity v grows, and the acceleration without the sine for an
  /// acceleration a.
  double opening(const Vec<D>& v, double t = 0) const { return along_normal(v) - velocity_at(t); }
  double speeding(const Vec<D>& a) const { return along_normal(a) - acceleration; }
  /// The velocity after the collision of a sphere with velocity v and a radius that grows at `rate`, with this
  /// coefficient of restitution.
  Vec<D> bounced(Vec<D> v, double t = 0, double rate = 0, double restitution = 1) const {
    const double u = velocity_at(t) + rate;
    if (axis >= 0)
      v[axis] = normal[axis] * ((1 + restitution) * u) - restitution * v[axis];
    else
      v += ((1 + restitution) * (u - normal.dot(v)) / normal.squaredNorm()) * normal;  // `normal` has rounding
    return v;
  }
  /// The work that this impulse does on a sphere at time t [energy].
  double work(const Vec<D>& impulse, double t = 0) const { return velocity_at(t) * along_normal(impulse); }
  bool thermal() const { return temperature > 0; }
  /// The point that a sphere at x touches at time t.
  Vec<D> foot(Vec<D> x, double t = 0) const {
    if (round > 0) {
      const Vec<D> from = from_centre(x);
      return x + (round / from.norm() - 1) * from;
    }
    if (axis >= 0)
      x[axis] = normal[axis] * level(t);
    else
      x -= (normal.dot(x) - level(t)) * normal;
    return x;
  }

  // Round walls.
  /// The part of a vector that is normal to the axis of a cylinder; for a sphere, the vector.
  Vec<D> across(const Vec<D>& u) const { return u - direction.dot(u) * direction; }
  /// From the centre, or from the nearest point of the axis, to x.
  Vec<D> from_centre(const Vec<D>& x) const { return across(x - centre); }
  /// The distance from the centre, or from the axis, at which a sphere with this radius touches.
  double reach(double radius) const { return inside ? round - radius : round + radius; }
  /// The wall as a sphere at x meets it: the plane that touches a round wall at the point nearest to x; a plane itself.
  Wall at(const Vec<D>& x) const {
    Wall plane = *this;
    if (!(round > 0)) return plane;
    const Vec<D> from = from_centre(x);
    plane.normal = (inside ? -1 : 1) / from.norm() * from;
    plane.offset = plane.normal.dot(centre) + (inside ? -round : round);
    plane.round = 0;
    return plane;
  }
  /// The curvature of the gap as a function of place, along the wall: negative inside, positive outside, zero for a
  /// plane. A sphere at x with the velocity v has the gap's acceleration n·a + curvature·|across(v)|², if v is normal
  /// to n [1/length].
  double curvature(const Vec<D>& x) const { return round > 0 ? (inside ? -1 : 1) / from_centre(x).norm() : 0; }
};

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
