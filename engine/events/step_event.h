// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// When a pair of spheres reaches one of its steps (laws/steps.h) or its core, and what happens there.
//
// Nothing is stored about the side of a step on which a pair is. It follows from the distance. At a step, within a
// tolerance, it follows from the direction of the relative motion, because after an event a pair moves away from the
// step into the side on which it is. For a pair that has just met, the tolerance is wide (`kJustMet`), since the place
// of an event is rounded more if its time is long; for others it is the rounding of positions. So a pair changes sides
// unseen only if a third sphere turns it, or a slab ends, while it is within rounding of a step. Monitor compares the
// energy of the steps with the ledger and ends the run then.

#include "engine/events/contact.h"
#include "engine/events/meeting.h"
#include "engine/laws/steps.h"

namespace carom {

/// A pair that has just met is within this distance of what it met, relative to the contact distance: far more than the
/// rounding of a place, and a tenth of Steps::kLeastSeparation.
inline constexpr double kJustMet = 1e-7;

/// At the start of an epoch a pair may have met at the end of the last one: this is the rounding of places after a
/// flight of 10⁵ contact distances, relative to one.
inline constexpr double kEpochRounding = 1e-11;

/// Within this distance of a step the direction of the motion decides on which side a pair is. `rounding`: of positions
/// (GapTolerance at 0).
inline double side_tolerance(bool just_met, bool starts_epoch, double sigma, double rounding) {
  return just_met ? kJustMet * sigma : starts_epoch ? kEpochRounding * sigma : rounding;
}

/// The number of steps outside of which a pair is. `slack` as in contact.h: a pair that neither approaches nor recedes
/// is outside, because on a tangent it recedes. A tether is never passed; images beyond it are not tethered.
template <int D>
std::size_t steps_passed(const PairSteps& steps, const PairMotion<D>& motion, double sigma, double tolerance,
                         double slack) {
  std::size_t passed = 0;
  for (const StepSurface& each : steps.surfaces) {
    const double gap = motion.distance - each.distance(sigma);
    if (gap < -tolerance || (gap <= tolerance && motion.b < -slack)) break;
    if (each.tether() && gap <= kJustMet * motion.distance) break;
    ++passed;
  }
  return passed;
}

/// Pairs that are nearer to a step, relative to the square of its distance, are looked at more closely: far more than
/// the tolerance and than rounding, and few pairs.
inline constexpr double kNearStep = 1e-9;

/// The time until a pair with straight relative motion reaches its core or a step. `slack()` as in wall_meeting().
/// step_times() in search/simd/scan_kernel.h gives the same bits for pairs that are not near a step.
template <int D, class Slack>
[[gnu::always_inline]] inline double next_step_time(const PairSteps& steps, const Vec<D>& d, const Vec<D>& v,
                                                    double sigma, double tolerance, Slack&& slack) {
  const double squared = d.squaredNorm(), b = d.dot(v);
  double inside = steps.core_distance(sigma), outside = kNever;
  bool near = squared <= inside * inside * (1 + kNearStep);
  for (const StepSurface& each : steps.surfaces) {
    const double range = each.distance(sigma), gap = squared - range * range;
    near = near || std::abs(gap) <= kNearStep * squared + 4 * tolerance * range;
    if (gap < 0) {
      outside = range;
      break;
    }
    inside = range;
  }
  if (near) [[unlikely]] {
    const PairMotion<D> motion{d, v};
    const double least = slack();
    const std::size_t passed = steps_passed(steps, motion, sigma, tolerance, least);
    inside = passed == 0 ? steps.core_distance(sigma) : steps.surfaces[passed - 1].distance(sigma);
    const double entering = contact_time<D>(d, v, inside, least);
    if (entering < kNever || passed == steps.surfaces.size()) return entering;
    return leaving_time(motion, steps.surfaces[passed].distance(sigma), least);
  }
  if (outside == kNever && b >= 0) return kNever;
  const double v2 = v.squaredNorm(), across = squared_cross<D>(d, v);
  if (b < 0)
    if (const double discriminant = v2 * inside * inside - across; discriminant > 0)
      return (squared - inside * inside) / (std::sqrt(discriminant) - b);
  if (outside == kNever || v2 == 0) return kNever;
  const double root = std::sqrt(v2 * outside * outside - across);
  return b > 0 ? (outside * outside - squared) / (b + root) : (root - b) / v2;
}

/// As above, for parabolic relative motion d + v s + a s²/2 in [0, time_left). Cores touch up to the gap
/// `core_tolerance`.
template <int D>
double next_step_time(const PairSteps& steps, const PairMotion<D>& motion, const Vec<D>& a, double sigma,
                      double time_left, double tolerance, double core_tolerance, double slack) {
  const std::size_t passed = steps_passed(steps, motion, sigma, tolerance, slack), number = steps.surfaces.size();
  const double inside = passed == 0 ? steps.core_distance(sigma) : steps.surfaces[passed - 1].distance(sigma);
  const double outside = passed == number ? kNever : steps.surfaces[passed].distance(sigma);
  const double path = time_left * (motion.v.norm() + 0.5 * time_left * a.norm()) + tolerance;
  if (motion.distance - path > inside && motion.distance + path < outside) return kNever;
  const bool at_core = passed == 0 && motion.distance <= inside + core_tolerance;
  const bool at_inside = passed > 0 && motion.distance <= inside + tolerance;
  const double entering = contact_time<D>(motion.d, motion.v, a, inside, time_left, at_core || at_inside, slack);
  if (outside == kNever) return entering;
  const bool at_outside = motion.distance >= outside - tolerance;
  return std::min(entering, leaving_time(motion, a, outside, time_left, at_outside, slack));
}

/// The step that a pair reaches at this distance; null: it reaches its core.
inline const StepSurface* step_at(const PairSteps& steps, double distance, double sigma) {
  const StepSurface* nearest = nullptr;
  double gap = std::abs(distance - steps.core_distance(sigma));
  for (const StepSurface& each : steps.surfaces)
    if (const double other = std::abs(distance - each.distance(sigma)); other < gap) gap = other, nearest = &each;
  return nearest;
}

/// What stops a pair whatever its energy: its core, which it meets from outside, or its tether, from inside.
struct HardSurface {
  double distance = 0;  ///< [length]
  double side = 1;      ///< −1: a tether
  bool tether() const { return side < 0; }
  /// The gap of a pair at this distance [length].
  double gap(double at) const { return side * (at - distance); }
};

/// The hard surface that is nearer to a pair at this distance. `sigma`: the sum of the radii.
inline HardSurface hard_surface(const Steps& steps, Id i, Id j, double sigma, double at) {
  const PairSteps* const bond = steps.find_bond(i, j);
  if (!bond) return {sigma};
  const double core = bond->core_distance(sigma);
  if (!bond->surfaces.empty() && bond->surfaces.back().tether())
    if (const double range = bond->surfaces.back().distance(sigma);
        range - at < at - core && at - range <= kJustMet * at)
      return {range, -1};
  return {core};
}

/// A tether pulls a pair back by the law of its contacts, without friction.
template <int D>
PairImpulse<D> tether_impulse(const ContactLaws& laws, const Vec<D>& d, const Vec<D>& v, const Partner<D>& a,
                              const Partner<D>& b) {
  PairImpulse<D> impulse = normal_impulse<D>(laws, -d, v, a, b);
  impulse.factor = -impulse.factor;
  impulse.event = PairEvent::bounce;
  return impulse;
}

/// A pair reaches a step. It crosses if b² > 2 c d² (1/m_i + 1/m_j), where c is the energy that it must climb, and
/// then b² decreases by this number; otherwise b changes its sign (Alder, Wainwright, J. Chem. Phys. 31 (1959) 459).
/// The factor has no cancellation for small c, and d is not normalised, so that the kinetic energy changes by −c to
/// rounding.
template <int D>
PairImpulse<D> step_impulse(const StepSurface& step, const ContactLaws& laws, const Vec<D>& d, const Vec<D>& v,
                            const Partner<D>& of_a, const Partner<D>& of_b) {
  if (step.tether()) return tether_impulse<D>(laws, d, v, of_a, of_b);
  const double b = d.dot(v), weight = d.squaredNorm() * (1 / of_a.mass + 1 / of_b.mass);
  const double climb = b > 0 ? step.climb : -step.climb, left = b * b - 2 * climb * weight;
  if (!(left > 0)) return {.factor = -2 * b / weight, .event = PairEvent::bounce};
  return {.factor = -2 * climb / (b + std::copysign(std::sqrt(left), b)),
          .stored = climb,
          .event = b > 0 ? PairEvent::leave : PairEvent::enter};
}

}  // namespace carom
