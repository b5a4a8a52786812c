// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// How wide the skin of a Verlet list is: what the list holds beyond its reach, so that it lasts while particles move.
//
// Wide enough for the step at hand and some more of its length, and as wide as particles come in some calls, where that
// is not too wide. It only shrinks by halves, and at once where it was made for a single long step. Results do not
// depend on it.

#include <algorithm>
#include <cstdint>
#include <string>

#include "engine/base/box.h"
#include "engine/base/error.h"

namespace carom {

class Skin {
 public:
  /// Not below `least`; as wide as any particle comes in so many `calls` (half of it lasts for half as many), where it
  /// need not be wider than `widest` for it. Lengths.
  Skin(double least, double calls, double widest) : least_(least), per_calls_(calls), widest_(widest) {}

  /// What the list that is there was made with.
  double width() const { return width_; }
  /// Sets the width; half of it is kept at the next renew().
  void begin(double width) { width_ = width; }

  /// Whether a list serves a step: particles have come, or will, so far from where they were when it was made
  /// (`from_build`), may deviate by `margin` besides, and move by `step` at most, with the margin. False where
  /// the list is not `known`.
  bool lasts(bool known, double from_build, double step, double margin = 0) {
    const double to_last = per_calls_ * from_build / static_cast<double>(++calls_);
    wanted_ = std::max({least_, 4 * step, known && to_last <= widest_ ? to_last : 0});
    wasteful_ = step > 0 && width_ > kTooWide * wanted_;  // made for one long step
    return known && from_build + margin <= 0.5 * width_ && !wasteful_;
  }

  /// Chooses the width for a list that is made now, after lasts(). Throws Error(Failure::numerical) for steps of
  /// several edges of a periodic box; `which()` names the particle.
  template <int D>
  void renew(const Box<D>& box, double step, const auto& which) {
    for (int k = 0; k < D; ++k)
      if (box.periodic(k) && !(step <= kMostBoxes * box.edges[k]))
        throw Error(Failure::numerical,
                    which() + " moves farther than " + std::to_string(kMostBoxes) +
                        " edges of the periodic box within one step; use a smaller integrator.step");
    width_ = std::max(wanted_, wasteful_ ? 0.0 : 0.5 * width_);
    calls_ = 0;
  }

 private:
  static constexpr double kTooWide = 64;  // in skins that would do: given up
  static constexpr int kMostBoxes = 4;    // edges of a periodic box that a particle may move in a step

  double least_, per_calls_, widest_;
  double width_ = 0, wanted_ = 0;
  bool wasteful_ = false;
  std::uint64_t calls_ = 0;  // since the list was made
};

}  // namespace carom
