// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Acceleration of slowly contracting fixed-point iterations with a known spectrum.
//
// The sweeps of a discrete-gradient slab of length h are a ← F(a) with F′ ≈ −h²ω²/4 for a mode of frequency ω. If
// the largest λ = h²ω²/4 is known, Chebyshev's semi-iteration for eigenvalues 1 … 1 + λ of I − F′,
//
//   a ← a + Δ,   Δ ← memory · Δ + gain · e,   e = F(a) − a,
//
// contracts by (√κ − 1)/(√κ + 1) per sweep, κ = 1 + λ, and also converges for λ > 1, where plain sweeps diverge. It
// needs no inner products, so all ranks compute the same numbers. (Saad, Iterative Methods for Sparse Linear Systems,
// 2nd ed., algorithm 12.1.)

#include <cmath>

namespace carom::integrator {

class Chebyshev {
 public:
  /// From here on Chebyshev's iteration is faster; plain sweeps contract by λ.
  static constexpr double kSmall = 0.2;

  /// For small λ, and for NaN, the sweeps are plain.
  explicit Chebyshev(double lambda = 0) : middle_(1 + lambda / 2), half_(lambda >= kSmall ? lambda / 2 : 0) {}

  /// Computes memory() and gain() for the next sweep.
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
  double middle_, half_;  // centre and half width of the spectrum
  double ratio_ = 0, memory_ = 0, gain_ = 1;
};

}  // namespace carom::integrator
