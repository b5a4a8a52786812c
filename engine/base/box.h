// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The simulation box: a rectangle or cuboid from the origin to `edges`, with a boundary rule for each axis.

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "engine/base/boundary.h"
#include "engine/base/wall.h"

namespace carom {

template <int D>
struct Box {
  Vec<D> edges = Vec<D>::Ones();  ///< [length]; within a slab: the edges at its start
  std::array<Boundary, D> boundary{};
  Vec<D> edge_velocity = Vec<D>::Zero();  ///< upper walls, along their axes [length/time]; nonzero: a piston

  bool periodic(int axis) const { return boundary[axis] == Boundary::periodic; }
  bool walled(int axis) const { return boundary[axis] == Boundary::wall; }
  bool piston(int axis) const { return walled(axis) && edge_velocity[axis] != 0; }
  bool pistons() const {
    for (int k = 0; k < D; ++k)
      if (piston(k)) return true;
    return false;
  }
  /// Whether some axis has this boundary.
  bool has(Boundary kind) const { return std::ranges::find(boundary, kind) != boundary.end(); }
  /// The box after a time, with its pistons moved.
  Box after(double time) const {
    Box later = *this;
    for (int k = 0; k < D; ++k)
      if (piston(k)) later.edges[k] += edge_velocity[k] * time;
    return later;
  }
  /// Whether all positions along the axis stay between 0 and the edge at all times.
  bool bounded(int axis) const { return boundary[axis] != Boundary::open && !piston(axis); }
  /// Whether all axes are bounded, so that the box has a density.
  bool closed() const {
    for (int k = 0; k < D; ++k)
      if (!bounded(k)) return false;
    return true;
  }
  /// The wall with this number; its axis must have walls.
  Wall<D> wall(Id number) const {
    const int axis = wall_axis(number);
    return number % 2 == 0 ? Wall<D>{axis, 1, 0, 0} : Wall<D>{axis, -1, edges[axis], -edge_velocity[axis]};
  }
  /// All walls, ordered by number.
  std::vector<Wall<D>> walls() const {
    std::vector<Wall<D>> all;
    for (Id number = 0; number < 2 * D; ++number)
      if (walled(wall_axis(number))) all.push_back(wall(number));
    return all;
  }
  /// The gap below which spheres count as touching, anywhere in the box.
  GapTolerance gap_tolerance() const { return GapTolerance(edges.maxCoeff()); }
  double volume() const { return edges.prod(); }

  /// The image that brings `d`, a difference of two positions, nearest to the origin: the number of edges to add on
  /// each axis.
  Image<D> nearest_image(const Vec<D>& d) const {
    Image<D> image{};
    for (int k = 0; k < D; ++k)
      if (periodic(k) && !(std::abs(d[k]) <= 0.5 * edges[k]))  // else the quotient rounds to zero
        image[k] = -static_cast<std::int32_t>(std::nearbyint(d[k] / edges[k]));
    return image;
  }

  /// The displacement of an image.
  Vec<D> shift(const Image<D>& image) const {
    Vec<D> s;
    for (int k = 0; k < D; ++k) s[k] = image[k] == 0 ? 0.0 : image[k] * edges[k];
    return s;
  }

  /// Brings a position back into [0, edge) along the periodic axes and counts the crossings in `image`.
  void wrap(Vec<D>& x, Image<D>& image) const {
    for (int k = 0; k < D; ++k) {
      if (!periodic(k) || (x[k] >= 0 && x[k] < edges[k])) continue;
      const double crossings = std::floor(x[k] / edges[k]);
      if (crossings == 0) continue;
      x[k] -= crossings * edges[k];
      image[k] += static_cast<std::int32_t>(crossings);
      if (x[k] >= edges[k]) {  // a tiny negative x rounds up to the edge itself
        x[k] = 0;
        image[k] += 1;
      }
    }
  }
};

}  // namespace carom
