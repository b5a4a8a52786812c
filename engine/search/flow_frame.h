// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The coordinates of a shear flow at one moment of a slab: x′ = x − γ̇ (t − t′) y, all others as they are.
//
// The images of a sheared box slide and its spheres move with the flow, but in these coordinates the lattice of images
// and the points that move with the flow stand still. Two such points with the separation d′ have the separation
// d′ + e d′_y at the strain e = γ̇ (t − t′) along x. So neighbours found in these coordinates remain near each other for
// all strains up to a limit (SkinLists).

#include <algorithm>
#include <cmath>

#include "engine/base/vec.h"

namespace carom {

/// The strain of a sheared box in a window (engine/ranks/windowed_flight.h). In it, a displacement relative to the flow
/// changes by at most this part of its length.
inline constexpr double kStrainOfWindow = 0.05;

struct FlowFrame {
  double rate = 0;          ///< γ̇ [1/time]; 0: there is no flow
  double time = 0;          ///< t′, since the start of the slab
  double from = 0, to = 0;  ///< the first and the last strain at which neighbours are needed

  /// For the times from `now` to `end` of a slab.
  static FlowFrame between(double rate, double now, double end) {
    FlowFrame frame{.rate = rate, .time = 0.5 * (now + end)};
    frame.from = frame.strain(now);
    frame.to = frame.strain(end);
    return frame;
  }

  double strain(double t) const { return rate * (t - time); }
  template <int D>
  Vec<D> coordinates(Vec<D> x, double t) const {
    if (rate != 0) x[0] -= strain(t) * x[1];
    return x;
  }
  /// The distance in these coordinates within which all points are that come as near as `reach`. The shear by e
  /// stretches lengths by at most its largest singular value, |e|/2 + √(1 + e²/4).
  double widened(double reach) const {
    if (rate == 0) return reach;
    const double e = 0.5 * std::max(std::abs(from), std::abs(to));
    return reach * (e + std::sqrt(1 + e * e));
  }
  /// The least squared distance that two points with this separation in these coordinates have.
  template <int D>
  double least_squared(Vec<D> d) const {
    if (rate != 0) {
      const auto [low, high] = std::minmax({d[0] + from * d[1], d[0] + to * d[1]});
      d[0] = low > 0 ? low : high < 0 ? high : 0;
    }
    return d.squaredNorm();
  }
};

}  // namespace carom
