// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The width of the halos, adapted to the speeds of particles and to slabs for which it was too small. All ranks have
// the same values.
//
// A division is valid until a particle is displaced by more than the slack; in each slab no path may exceed an allowed
// length. A rank has all particles that it needs within the reach of forces plus twice the slack and twice the path of
// its part of the box. Ghosts matter if their contacts may be contacts of its own particles: they are within the
// largest diameter plus twice the slack and the path. Ghosts beyond, to the depth over which collisions propagate
// errors from the rim, keep these ghosts correct. The end points of all other ghosts come from their owners.

#include <utility>

namespace carom {

class HaloWidth {
 public:
  /// Resets the widths; `cores`: particles collide.
  void start(bool cores) { least_depth_ = depth_ = cores ? kMinDepth : 0; }
  /// Sets the widths for a division of particles with forces of range `reach`, paths up to `path` in a slab at present
  /// speeds, and this largest diameter [length].
  void fit(double reach, double path, double diameter);
  /// Ghosts matter within near() of a rank's part of the box; a rank has ghosts within far().
  double near() const { return near_; }
  double far() const { return far_; }
  /// Whether the widths suffice for a slab with paths of this length.
  bool allows(double path) const { return path <= path_; }

  /// Call after a slab with too narrow halos: the next fit() allows paths of this length, or doubles the depth.
  void ask_for_path(double path);
  void ask_for_depth() { depth_ *= 2, asked_ = true; }
  /// Whether the last slab asked for a wider halo that is finite; forgets it. If none was asked for, all ranks get all
  /// particles.
  bool take_request() { return std::exchange(asked_, false); }
  /// Call if the last division was good enough: the next halos may be narrower.
  void relax();

  /// Whether the next outdated() will call farthest().
  bool looks_next() const { return safe_slabs_ < 1; }
  /// Call before a slab: whether a particle may be displaced too far since fit(). Calls farthest(), the largest
  /// displacement, only if necessary.
  template <class Farthest>
  bool outdated(Farthest&& farthest) {
    if (safe_slabs_ >= 1) {
      --safe_slabs_;
      return false;
    }
    const double left = kUsableSlack * slack_ - farthest();
    safe_slabs_ = left / path_;
    return left < 0;
  }

 private:
  static constexpr double kMinDepth = 3;       // depth of ghosts around those that matter [largest diameter]
  static constexpr double kUsableSlack = 0.8;  // fraction of the slack that may be used

  double near_ = 0, far_ = 0;
  double path_ = 0, slack_ = 0;
  double safe_slabs_ = 0;               // until a particle may be displaced too far
  double wanted_path_ = 0;              // lower bound, after a path was too long recently
  bool asked_ = false;                  // the slab needs a larger halo, of finite width
  double least_depth_ = 0, depth_ = 0;  // depth of ghosts around those that matter [largest diameter]
};

}  // namespace carom
