// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Contacts of discrete-gradient pieces: how a piece of length τ ends, and where the first contact may be.
//
// The contacts are those of the chords, the straight lines from x to x'. c(τ) is the time of the first contact on the
// chords or, beyond τ, on their extension: the piece that ends in contact is a fixed point of c. A pair that touches at
// the start has the trivial contact τ = 0. The function gap(τ)/τ ≈ (2 d·v̄ + τ v̄²)/2σ does not have this zero: it starts
// at the velocity of separation and falls through zero where the pair meets again.
//
// A pair inside a step or a tether meets it from inside: there the gap and its rates have the other sign. step_event.h
// says on which side of a step a pair is at the start. A pair that is on another side at the end of a piece, within the
// tolerance, has arrived at the step, and its event is due at once, since nothing else is stored about its side.

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/events/step_event.h"
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

/// A pair that has reached a step at the end of a piece. Its side is 1 if it comes from outside, −1 from inside.
template <int D>
struct Arrival {
  EventKey<D> key;
  const StepSurface* step = nullptr;
  double side = 1;
};

template <int D>
class ChordContacts {
 public:
  ChordContacts(const System<D>& system, ContactScan<D>& scan) : system_(system), scan_(scan) {}

  /// The pairs that have reached a step at the end of the last piece that was judged, in the order of their keys.
  std::span<const Arrival<D>> arrivals() const { return arrivals_; }

  /// Judges the last solve of `piece`, which went from (x, v) over tau.
  PieceEnd<D> judge(Positions<D> x, Positions<D> v, const DiscreteGradient<D>& piece, double tau) {
    PieceEnd<D> end;
    EventKey<D> key;
    const auto &chord = piece.chord(), &v_end = piece.v();
    const bool has_steps = !system_.box.steps.empty();
    arrivals_.clear();
    for (const auto& pair : scan_.list().cover(x, piece.x())) {
      const Id i = pair.i, j = pair.j;
      key.lo = i;
      key.hi = j;
      key.image = pair.image;
      const Vec<D> d = x[i] - x[j] + system_.box.shift(pair.image), u = chord[i] - chord[j];
      if (has_steps) [[unlikely]]
        if (const PairSteps* const steps = scan_.steps(i, j)) {
          judge_steps(key, *steps, d, u, x, v, piece, tau, end);
          continue;
        }
      const double sigma = system_.particles.radius[i] + system_.particles.radius[j];
      const double reach = sigma + tau * u.norm() + scan_.tolerance(sigma);
      if (d.squaredNorm() > reach * reach * kProlongation || scan_.rests(key)) continue;
      const double slack = sigma * (scan_.rounding_speed(i, v[i]) + scan_.rounding_speed(j, v[j]));
      judge_pair(key, 1, d, d + tau * u, u, v[i] - v[j], v_end[i] - v_end[j], sigma, scan_.tolerance(sigma), tau, slack,
                 end);
    }
    std::ranges::sort(arrivals_, {}, &Arrival<D>::key);
    key.kind = EventKind::wall;
    key.image = {};
    for (Id i = 0; i < x.size(); ++i)
      for (const Wall<D>& wall : scan_.walls()) {
        key.lo = i;
        key.hi = wall.number;
        if (system_.particles.fixed(i) || scan_.rests(key)) continue;
        const double radius = system_.particles.radius[i];
        if (wall.round > 0) {
          judge_round_wall(wall, key, x[i], v[i], chord[i], v_end[i], radius, tau, end);
          continue;
        }
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

  /// The rounding of the distance of two positions, which may be far outside an open box.
  double rounding_at(const Vec<D>& a, const Vec<D>& b) const {
    const double farthest = std::max(a.cwiseAbs().maxCoeff(), b.cwiseAbs().maxCoeff());
    return std::max(scan_.tolerance(0), GapTolerance(farthest)(0));
  }

  /// A pair with steps, at the surfaces that it can reach next.
  void judge_steps(const EventKey<D>& key, const PairSteps& steps, const Vec<D>& d, const Vec<D>& u, Positions<D> x,
                   Positions<D> v, const DiscreteGradient<D>& piece, double tau, PieceEnd<D>& end) {
    const auto& radius = system_.particles.radius;
    const auto &x_end = piece.x(), &v_end = piece.v();
    const Id i = key.lo, j = key.hi;
    const double sigma = radius[i] + radius[j], rounding = rounding_at(x[i], x[j]);
    const double far = steps.farthest(sigma) + scan_.tolerance(sigma) + 2 * tau * u.norm();
    if (d.squaredNorm() > far * far) return;
    const Vec<D> d_end = x_end[i] - x_end[j] + system_.box.shift(key.image);  // as the next piece computes it
    const Vec<D> v_start = v[i] - v[j], v_last = v_end[i] - v_end[j];
    const std::size_t passed =
        steps_passed<D>(steps, {d, v_start}, sigma, rounding, approach_slack(sigma, v[i].norm(), v[j].norm()));
    const auto hard = [&](double side, double distance) {
      if (scan_.rests(key)) return;
      const double slack = sigma * (scan_.rounding_speed(i, v[i]) + scan_.rounding_speed(j, v[j]));
      judge_pair(key, side, d, d_end, u, v_start, v_last, distance, scan_.tolerance(sigma), tau, slack, end);
    };
    const auto step = [&](double side, const StepSurface& surface) {
      const double distance = surface.distance(sigma), gap = d_end.norm() - distance;
      // On a tangent a pair is outside.
      const double slack = side * approach_slack(sigma, v_end[i].norm(), v_end[j].norm());
      const double rounding_last = rounding_at(x_end[i], x_end[j]);  // as the next piece computes it
      judge_pair(key, side, d, d_end, u, v_start, v_last, distance, std::min(rounding, rounding_last), tau, slack, end);
      if (std::abs(gap) <= rounding_last && side * d_end.dot(v_last) < -slack)
        arrivals_.push_back({key, &surface, side});
    };
    if (passed == 0)
      hard(1, steps.core_distance(sigma));
    else
      step(1, steps.surfaces[passed - 1]);
    if (passed == steps.surfaces.size()) return;
    if (const StepSurface& next = steps.surfaces[passed]; next.tether())
      hard(-1, next.distance(sigma));
    else
      step(-1, next);
  }

  /// A pair and the distance `sigma`, which it meets from outside (side = 1) or from inside (−1).
  void judge_pair(const EventKey<D>& key, double side, const Vec<D>& d, const Vec<D>& d_end, const Vec<D>& u,
                  const Vec<D>& v, const Vec<D>& v_end, double sigma, double tolerance, double tau, double slack,
                  PieceEnd<D>& end) const {
    const double gap = side * (d.norm() - sigma), gap_end = side * (d_end.norm() - sigma);
    if (gap > tolerance) {
      const double c = side > 0 ? contact_time<D>(d, u, sigma, 0.0) : leaving_time<D>(PairMotion<D>{d, u}, sigma, 0.0);
      if (std::abs(gap_end) <= kClosed * tolerance)
        end.touches = true;
      else if (c < tau)
        violate(key, end);
      end.contact = std::min(end.contact, c);
      return;
    }
    const double departing = side * 2 * d.dot(v), quotient = side * (2 * d.dot(u) + tau * u.squaredNorm());
    const bool through = side > 0 && d.dot(u) < 0 && d.dot(d_end) < 0.5 * sigma * sigma;
    if (gap_end < scan_.floor(gap, tolerance) || through)
      violate(key, end);
    else if (gap_end <= tolerance && side * d_end.dot(v_end) < -slack)
      end.touches = true;
    if (quotient < departing)
      end.contact = std::min(end.contact, std::max(0.0, departing) * tau / (departing - quotient));
  }

  /// A sphere meets a round wall as it meets another sphere, or as a pair meets its tether.
  void judge_round_wall(const Wall<D>& wall, const EventKey<D>& key, const Vec<D>& x, const Vec<D>& v,
                        const Vec<D>& chord, const Vec<D>& v_end, double radius, double tau, PieceEnd<D>& end) const {
    const Vec<D> d = wall.from_centre(x), u = wall.across(chord);
    const double reach = wall.reach(radius), slack = reach * scan_.rounding_speed(key.lo, v);
    judge_pair(key, wall.inside ? -1 : 1, d, d + tau * u, u, wall.across(v), wall.across(v_end), reach,
               scan_.tolerance(radius), tau, slack, end);
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
  std::vector<Arrival<D>> arrivals_;
};

}  // namespace carom::integrator
