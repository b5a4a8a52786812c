// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Fixed-point iterations that contract slowly, made faster by what is known of their spectrum.
//
// The sweeps of a discrete-gradient slab of length h are a ← F(a) with F′ ≈ −h²ω²/4 for a mode of frequency ω. Where
// the largest λ = h²ω²/4 is known, Chebyshev's semi-iteration for eigenvalues 1 … 1 + λ of I − F′,
//
//   a ← a + Δ,   Δ ← memory · Δ + gain · e,   e = F(a) − a,
//
// contracts by (√κ − 1)/(√κ + 1) a sweep, κ = 1 + λ, and converges where plain sweeps do not, λ > 1. It takes no inner
// products, so all ranks do the same. (Saad, Iterative Methods for Sparse Linear Systems, 2nd ed., algorithm 12.1.)

#include <cmath>

namespace carom::integrator {

class Chebyshev {
 public:
  /// Plain sweeps for small λ, and for NaN.
  explicit Chebyshev(double lambda = 0) : middle_(1 + lambda / 2), half_(lambda >= kSmall ? lambda / 2 : 0) {}

  /// Gives memory() and gain() for the next sweep.
  void next() {
    if (plain()) return;
    const double ratio = ratio_ == 0 ? half_ / middle_ : 1 / (2 * middle_ / half_ - ratio_);
    memory_ = ratio * ratio_;
    gain_ = ratio_ == 0 ? 1 / middle_ : 2 * ratio / half_;
    ratio_ = ratio;
  }

  bool plain() const { return half_ == 0; }  ///< memory 0 and gain 1
  double rate() const { return half_ == 0 ? 0 : (middle_ - std::sqrt(middle_ * middle_ - half_ * half_)) / half_; }
  double memory() const { return memory_; }
  double gain() const { return gain_; }

 private:
  static constexpr double kSmall = 0.2;

  double middle_, half_;  // of the spectrum
  double ratio_ = 0, memory_ = 0, gain_ = 1;
};

}  // namespace carom::integrator
