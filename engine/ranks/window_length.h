// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The length of a window, chosen so that a sphere has kCollisionsPerWindow, 0.15, collisions in it and moves no farther
// than `max_displacement` from its start.

#include <functional>
#include <limits>

#include "engine/base/particles.h"
#include "engine/base/sizes.h"
#include "engine/ranks/communicator.h"
#include "engine/search/flow_frame.h"

namespace carom {

template <int D>
class WindowLength {
 public:
  /// `diameter`: the largest. `forced` returns an upper limit of the length of windows [time].
  explicit WindowLength(double diameter, std::function<double()> forced = {})
      : diameter_(diameter), forced_(std::move(forced)) {}

  /// Call at the start of an epoch; this rank has a block of the spheres. Collective.
  void start(const Box<D>& box, const Sizes& sizes, Communicator& ranks, const Particles<D>& block, const Vec<D>& g,
             double horizon);
  /// The largest displacement of a sphere in a window.
  double max_displacement() const { return max_displacement_; }
  /// The end of the next window on the way to `end`, or to about this many collisions from now.
  double window_end(double now, double end, double collisions = std::numeric_limits<double>::infinity()) const;
  /// The number of collisions expected in a window of this length.
  double expected(double length) const { return length > 0 ? each_ * length / pace_ : 0; }
  /// Whether a sphere with this speed after an event may have moved too far in a window of this length.
  bool too_fast(double speed, double length) const {
    speed = stretch_ * speed + field_;
    return speed > fastest_ && speed * length > max_displacement_;
  }
  /// Later windows allow for spheres of this speed; the same on all ranks.
  void allow_for(double speed);
  /// Call after a window of this length in which all spheres together had this many collisions.
  void note(double length, std::uint64_t collisions);

 private:
  double diameter_;
  std::function<double()> forced_;
  double max_displacement_ = 0;
  double field_ = 0;                                          // speed that the field may add in the epoch
  double longest_ = std::numeric_limits<double>::infinity();  // window in a sheared box
  double stretch_ = 1;  // by which the flow may lengthen a displacement relative to it in a window
  double fastest_ = 0;  // largest speed expected
  double pace_ = 0;     // estimated time in which a sphere has kCollisionsPerWindow collisions
  double each_ = 0;     // collisions of all spheres in that time
};

}  // namespace carom
