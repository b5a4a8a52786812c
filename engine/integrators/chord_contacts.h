// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Contacts of discrete-gradient pieces: how a piece of length τ ends, and where the first contact may be.
//
// The contacts are those of the chords, the straight lines from x to x'. c(τ) is the time of the first contact on the
// chords or, beyond τ, on their extension: the piece that ends in contact is a fixed point of c. A pair that touches at
// the start has the trivial contact τ = 0. The function gap(τ)/τ ≈ (2 d·v̄ + τ v̄²)/2σ does not have this zero: it starts
// at the velocity of separation and falls through zero where the pair meets again.

#include <algorithm>
#include <cmath>

#include "engine/integrators/discrete_gradient.h"
#include "engine/stepping/contact_scan.h"

namespace carom::integrator {

/// How a piece of length τ ends.
template <int D>
struct PieceEnd {
  bool converged = true;    ///< whether the solver converged; if not, nothing else is set
  bool violates = false;    ///< a sphere overlaps another sphere or a wall, or has passed through it
  bool touches = false;     ///< a gap is closed to the tolerance
  double contact = kNever;  ///< c(τ)
  EventKey<D> violator{};   ///< the contact that overlaps
};

template <int D>
class ChordContacts {
 public:
  ChordContacts(const System<D>& system, ContactScan<D>& scan) : system_(system), scan_(scan) {}

  /// Judges the last solve of `piece`, which went from (x, v) over tau.
  PieceEnd<D> judge(Positions<D> x, Positions<D> v, const DiscreteGradient<D>& piece, double tau) const {
    PieceEnd<D> end;
    EventKey<D> key;
    const auto &chord = piece.chord(), &v_end = piece.v();
    for (const auto& pair : scan_.list().cover(x, piece.x())) {
      const Id i = pair.i, j = pair.j;
      key.lo = i;
      key.hi = j;
      key.image = pair.image;
      const Vec<D> d = x[i] - x[j] + system_.box.shift(pair.image), u = chord[i] - chord[j];
      const double sigma = scan_.contact_distance(i, j);
      const double reach = sigma + tau * u.norm() + scan_.tolerance(sigma);
      if (d.squaredNorm() > reach * reach * kProlongation || scan_.rests(key)) continue;
      const double slack = sigma * (scan_.rounding_speed(i, v[i]) + scan_.rounding_speed(j, v[j]));
      judge_pair(key, d, u, v[i] - v[j], v_end[i] - v_end[j], sigma, tau, slack, end);
    }
    key.kind = EventKind::wall;
    key.image = {};
    for (Id i = 0; i < x.size(); ++i)
      for (const Wall<D>& wall : scan_.walls()) {
        key.lo = i;
        key.hi = wall.number;
        if (system_.particles.fixed(i) || scan_.rests(key)) continue;
        const double radius = system_.particles.radius[i];
        judge_wall(key, wall.gap(x[i], radius), wall.opening(chord[i], 0.5 * tau), wall.opening(v[i]),
                   wall.opening(v_end[i], tau), radius, tau, scan_.rounding_speed(i, v[i]), end);
      }
    return end;
  }

 private:
  /// A piece ends in contact within this fraction of the tolerance, so that its rounded positions touch, too.
  static constexpr double kClosed = 0.5;
  /// Contacts are found up to twice the reach of the chord, squared here; only those near its end matter for c(τ) = τ.
  static constexpr double kProlongation = 4;

  static void violate(const EventKey<D>& key, PieceEnd<D>& end) {
    end.violates = true;
    end.violator = key;
  }

  void judge_pair(const EventKey<D>& key, const Vec<D>& d, const Vec<D>& u, const Vec<D>& v, const Vec<D>& v_end,
                  double sigma, double tau, double slack, PieceEnd<D>& end) const {
    const double tolerance = scan_.tolerance(sigma);
    const Vec<D> d_end = d + tau * u;
    const double gap_end = d_end.norm() - sigma;
    if (d.norm() - sigma > tolerance) {
      const double c = contact_time<D>(d, u, sigma, 0.0);
      if (std::abs(gap_end) <= kClosed * tolerance)
        end.touches = true;
      else if (c < tau)
        violate(key, end);
      end.contact = std::min(end.contact, c);
      return;
    }
    const double departing = 2 * d.dot(v), quotient = 2 * d.dot(u) + tau * u.squaredNorm();
    const bool through = d.dot(u) < 0 && d.dot(d_end) < 0.5 * sigma * sigma;
    if (gap_end < scan_.floor(d.norm() - sigma, tolerance) || through)
      violate(key, end);
    else if (gap_end <= tolerance && d_end.dot(v_end) < -slack)
      end.touches = true;
    if (quotient < departing)
      end.contact = std::min(end.contact, std::max(0.0, departing) * tau / (departing - quotient));
  }

  void judge_wall(const EventKey<D>& key, double gap, double u, double v, double v_end, double radius, double tau,
                  double slack, PieceEnd<D>& end) const {
    const double tolerance = scan_.tolerance(radius), gap_end = gap + tau * u;
    if (gap > tolerance) {
      if (std::abs(gap_end) <= kClosed * tolerance)
        end.touches = true;
      else if (gap_end < 0)
        violate(key, end);
      if (u < 0) end.contact = std::min(end.contact, gap / -u);
      return;
    }
    if (gap_end < scan_.floor(gap, tolerance))
      violate(key, end);
    else if (gap_end <= tolerance && v_end < -slack)
      end.touches = true;
    if (u < v) end.contact = std::min(end.contact, std::max(0.0, v) * tau / (v - u));
  }

  const System<D>& system_;
  ContactScan<D>& scan_;
};

}  // namespace carom::integrator
