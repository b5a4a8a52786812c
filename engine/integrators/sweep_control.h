// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// When the sweeps of an implicit step have converged, when they stall, and when they contract slowly.

#include <algorithm>
#include <array>

#include "engine/base/elementary.h"
#include "engine/integrators/chebyshev.h"

namespace carom::integrator {

/// The residuals of the sweeps of one step, or piece of a step, and what follows from them. A residual is the largest
/// change of a velocity that another sweep would make, h |e| [length/time].
class SweepControl {
 public:
  static constexpr int kMostSweeps = 60;

  /// `wanted`: the residual that is small enough; 0: that of rounding.
  explicit SweepControl(double wanted) : wanted_(wanted) {}

  int sweep() const { return sweep_; }
  double wanted() const { return wanted_; }
  bool below_limit() const { return sweep_ < kMostSweeps; }

  /// The residual of a further sweep. `rounding`: the residual that the rounding of forces may leave.
  void note(double residual, double rounding) {
    residual_[++sweep_] = residual;
    rounding_ = rounding;
  }
  /// Whether the last residual is one of rounding: it is zero, or small and no longer falls.
  bool converged() const {
    return last() == 0 || (sweep_ > 2 && last() <= rounding_ && last() > 0.25 * residual_[sweep_ - 1]);
  }
  bool good_enough() const { return converged() || last() <= wanted_; }
  /// From now on only the residual of rounding is small enough.
  void want_rounding() { wanted_ = 0; }

  /// Whether particles that swap partners may be frozen.
  bool may_freeze() const { return sweep_ >= kBeforeFreezing; }
  /// Whether the last sweeps have hardly reduced the residual although the forces are not stiff; `rate`: the
  /// contraction of a sweep that their stiffness explains.
  bool stalls(double rate) const {
    const double stalled = std::max(kStalled, 2 * elementary::pow(rate, kBeforeFreezing));
    return sweep_ > kBeforeFreezing && sweep_ % kBeforeFreezing == 0 && stalled < kTooStiff &&
           last() > stalled * residual_[sweep_ - kBeforeFreezing];
  }
  /// Counts a stall; false: there were too many, and a shorter step is better.
  bool may_stall_again() { return ++stalls_ <= kMostStalls; }
  /// Whether the sweeps contract so slowly that the forces must be stiff.
  bool slow() const {
    return sweep_ > kBeforeStiff && last() > std::max(10 * wanted_, kStiffContraction * residual_[sweep_ - 2]);
  }
  /// The contraction of kBeforeFreezing sweeps that counts as a stall; particles with at least this fraction of the
  /// largest residual cause it.
  static constexpr double kStalled = 0.1;

 private:
  static constexpr int kBeforeFreezing = 6;  // sweeps
  static constexpr int kBeforeStiff = 4;     // sweeps
  static constexpr int kMostStalls = 2;
  static constexpr double kTooStiff = 0.5;  // if such a contraction is expected, stiffness freezes no particle
  static constexpr double kStiffContraction = Chebyshev::kSmall * Chebyshev::kSmall;  // of two sweeps

  double last() const { return residual_[sweep_]; }

  double wanted_, rounding_ = 0;
  int sweep_ = 0, stalls_ = 0;
  std::array<double, kMostSweeps + 1> residual_{};  // by sweep, from 1
};

}  // namespace carom::integrator
