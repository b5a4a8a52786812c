// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// One discrete-gradient piece: from (x, v) over a time τ to (x', v') with exactly the same energy.
//
//   (x' − x)/τ = (v + v')/2,    M (v' − v)/τ = −∇̄V(x, x'),    ∇̄V·(x' − x) = V(x') − V(x)
//
// whatever τ (Gonzalez, J. Nonlinear Sci. 6 (1996) 449). Solved by fixed-point iteration on the mean velocity,
// v̄ ← v − (τ/2) M⁻¹ ∇̄V(x, x + τ v̄), until the increments stop shrinking: they are rounding errors then, and so is the
// energy error. Order 4 composes five pieces γτ, γτ, (1−4γ)τ, γτ, γτ, γ = 1/(4 − 4^{1/3}) (Suzuki, Phys. Lett. A 146
// (1990) 319).

#include "engine/forces/forces.h"
#include "engine/stepping/contact_scan.h"

namespace carom::integrator {

template <int D>
class DiscreteGradient {
 public:
  /// order: 2 or 4.
  DiscreteGradient(System<D>& system, int order);

  /// Computes x() and v() from (x, v) over `tau`. The resting contacts of `scan` are held by reactions λ(d + d'), λ ≥
  /// 0, that do no work because |d'| = |d|. Returns false if the iteration contracts too slowly: use a shorter piece.
  bool solve(Positions<D> x, Positions<D> v, double tau, ContactScan<D>& scan, Counters& counters);

  const std::vector<Vec<D>>& x() const { return x_; }                          ///< x' of the last solve
  const std::vector<Vec<D>>& v() const { return v_; }                          ///< v' of the last solve
  const std::vector<Vec<D>>& chord() const { return chord_; }                  ///< (x' − x)/τ of the last solve
  const std::vector<Vec<D>>& a() const { return mean_acceleration_.front(); }  ///< mean accelerations of the last solve

 private:
  bool substep(double tau, std::size_t stage, ContactScan<D>& scan, Counters& counters);

  const System<D>& system_;
  std::vector<double> fractions_;
  std::vector<std::vector<Vec<D>>>
      mean_acceleration_;  // for each stage of the last solve; the next solve starts from them
  std::vector<Vec<D>> x_, v_, chord_, trial_, force_, mean_, next_;
};

}  // namespace carom::integrator
