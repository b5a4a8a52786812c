// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// How long a window may be, so that spheres collide a few tenths of a time in it and none comes farther than
// `max_displacement` from where it was at its start; and when one was so fast that it may have.

#include <functional>

#include "engine/ranks/subdomain.h"

namespace carom {

template <int D>
class WindowLength {
 public:
  /// `diameter`: the largest. `forced` gives the length of windows [time], where they would be longer.
  explicit WindowLength(double diameter, std::function<double()> forced = {})
      : diameter_(diameter), forced_(std::move(forced)) {}

  /// At the start of an epoch, for the spheres of all ranks, of which this one has a block. Collective.
  void start(const Box<D>& box, const Sizes& sizes, Communicator& ranks, const Particles<D>& block, const Vec<D>& g,
             double horizon);
  /// How far a sphere comes in a window at most.
  double max_displacement() const { return max_displacement_; }
  /// The end of the next window on the way to `end`.
  double window_end(double now, double end) const;
  /// When a sphere may first have come farther than `max_displacement` in a window; infinite: never. The next ones
  /// allow for its speed. Null: this rank has no subdomain. Collective.
  double first_beyond(Subdomain<D>* subdomain, double now, double end, Communicator& ranks);
  /// After a window of this length in which so many spheres had so many collisions.
  void note(double length, std::uint64_t collisions, std::size_t spheres);

 private:
  double beyond_at(Subdomain<D>& subdomain, Slot i, double now, double end) const;

  double diameter_;
  std::function<double()> forced_;
  double max_displacement_ = 0;
  double field_ = 0;    // the speed that the field may add in the epoch
  double fastest_ = 0;  // the largest speed expected
  double pace_ = 0;     // time in which a sphere collides kCollisions times, about
};

}  // namespace carom
