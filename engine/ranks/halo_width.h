// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// How wide the halo of each rank has to be: learned from how fast particles are and from slabs for which it was not
// wide enough. All ranks have the same.
//
// A division is good until a particle has come farther than the slack, in slabs in which none comes farther than a
// path. So copies matter to own particles within what forces and contacts reach and twice both; copies beyond these, as
// deep as collisions carry what is missed at the rim, keep those that matter right.

#include <utility>

namespace carom {

class HaloWidth {
 public:
  /// Starts anew; `cores`: particles collide.
  void start(bool cores) { least_depth_ = depth_ = cores ? kLeastDepth : 0; }
  /// For a division of particles that feel each other within `reach`, come as far as `path` in a slab as fast as they
  /// are now, and have this largest diameter [length].
  void fit(double reach, double path, double diameter);
  /// Copies matter within this distance of a rank's part of the box, and are known within that.
  double near() const { return near_; }
  double far() const { return far_; }
  /// Whether a slab may have paths so long.
  bool allows(double path) const { return path <= path_; }

  /// After a slab for which this was too narrow: the next fit() allows for paths so long, or has copies twice as deep.
  void ask_for_path(double path);
  void ask_for_depth();
  /// Whether the last slab asked for more, and more is finite; not twice.
  bool asked() { return std::exchange(asked_, false); }
  /// All has gone well since the last division: the next one may be narrower.
  void relax();

  /// Before a slab: whether a particle may have come too far for it since fit(). Calls farthest(), the farthest that
  /// one has come, only where that may be.
  template <class Farthest>
  bool outdated(Farthest&& farthest) {
    if (safe_slabs_ >= 1) {
      --safe_slabs_;
      return false;
    }
    const double left = kUsed * slack_ - farthest();
    safe_slabs_ = left / path_;
    return left < 0;
  }

 private:
  static constexpr double kLeastDepth = 3;  // of copies that do not matter [largest diameter]
  static constexpr double kUsed = 0.8;      // of the slack

  double near_ = 0, far_ = 0;
  double path_ = 0, slack_ = 0;
  double safe_slabs_ = 0;               // until a particle may have come too far
  double wanted_path_ = 0;              // at least that, since one was too long not long ago
  bool asked_ = false;                  // a larger halo would have been enough for the slab
  double least_depth_ = 0, depth_ = 0;  // of copies that do not matter [largest diameter]
};

}  // namespace carom
