// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Chooses the skin of a Verlet list: the distance by which the list exceeds the reach, so that it lasts while particles
// move.
//
// The skin covers the current step and some more of its length, and the displacements of several calls if this is not
// too wide. It shrinks by half at a time, or at once after a single long step. Results do not depend on it.

#include <algorithm>
#include <cstdint>
#include <string>

#include "engine/base/error.h"
#include "engine/laws/box.h"

namespace carom {

class Skin {
 public:
  /// The skin is at least `least` [length] and as wide as any particle moves in `calls` calls (the list then lasts for
  /// half as many calls), unless this is more than `widest` [length].
  Skin(double least, double calls, double widest) : least_(least), per_calls_(calls), widest_(widest) {}

  /// The skin of the current list.
  double width() const { return width_; }
  /// Sets the width; the next renew() keeps at least half of it.
  void begin(double width) { width_ = width; }

  /// Whether a list can be used for a step: particles are, or will be, up to `from_build` from their positions at the
  /// build, may deviate by another `margin`, and move by at most `step`, the margin included. False if the list is not
  /// `known`.
  bool lasts(bool known, double from_build, double step, double margin = 0) {
    const double to_last = per_calls_ * from_build / static_cast<double>(++calls_);
    wanted_ = std::max({least_, 4 * step, known && to_last <= widest_ ? to_last : 0});
    wasteful_ = step > 0 && width_ > kWastefulWidth * wanted_;  // made for one long step
    return known && from_build + margin <= 0.5 * width_ && !wasteful_;
  }

  /// Chooses the width for a list that is built now, after lasts(). Throws Error(Failure::numerical) for steps of
  /// several edges of a periodic box; `which()` names the particle.
  template <int D>
  void renew(const Box<D>& box, double step, const auto& which) {
    for (int k = 0; k < D; ++k)
      if (box.periodic(k) && !(step <= kMaxBoxesPerStep * box.edges[k]))
        throw Error(Failure::numerical,
                    which() + " moves farther than " + std::to_string(kMaxBoxesPerStep) +
                        " edges of the periodic box within one step; use a smaller integrator.step");
    width_ = std::max(wanted_, wasteful_ ? 0.0 : 0.5 * width_);
    calls_ = 0;
  }

 private:
  static constexpr double kWastefulWidth = 64;  // relative to the sufficient skin: a wider one is dropped at once
  static constexpr int kMaxBoxesPerStep = 4;    // edges of a periodic box that a particle may move in a step

  double least_, per_calls_, widest_;
  double width_ = 0, wanted_ = 0;
  bool wasteful_ = false;
  std::uint64_t calls_ = 0;  // since the list was built
};

}  // namespace carom
