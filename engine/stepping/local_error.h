// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The local error of a step, from which methods that conserve energy at any step choose their steps.
//
// A step of length h moves a particle as if its mean acceleration were constant. If the acceleration changes at the
// rate j, the position at the end is wrong by ∫∫ j (t − h/2) dt dt = j h³/12. The mean accelerations a and a⁻ of this
// step and the one before belong to the middles of the steps, so j = 2 |a − a⁻|/(h + h⁻).

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "engine/ranks/system.h"

namespace carom {

/// The largest local error of any particle, relative to its diameter; of a point: to the mean distance of the
/// particles.
struct LocalError {
  double rate = 0;       ///< the error of a step of length h is rate · h³ [1/time³]
  Id id = 0;             ///< the particle
  double strongest = 0;  ///< the largest acceleration by forces [length/time²]
  double of(double length) const { return rate * length * length * length; }
  /// Keeps the larger error and the larger acceleration.
  void add(const LocalError& other) {
    const double most = std::max(strongest, other.strongest);
    if (other.rate > rate) *this = other;
    strongest = most;
  }
};

/// Thrown on all ranks together: the slab is repeated with this length, because it is not accurate enough, has too many
/// contacts, or its equations cannot be solved.
struct StepTooLong {
  double length = 0;
  std::optional<Id> id{};  ///< the particle with the largest error, if the step is not accurate enough
};

/// The length to which the error of a particle is relative: its diameter or, of a point, the mean distance.
inline double length_of_error(double radius, double mean_distance) { return radius > 0 ? 2 * radius : mean_distance; }

/// The local error of a step of length h with mean accelerations a, if those of the step before, of length h_before,
/// were a_before (h_before = 0: these are the accelerations at its start). Changes of acceleration below `noise` are
/// rounding. Collective.
template <int D>
LocalError local_error(const System<D>& system, Positions<D> a, Positions<D> a_before, double h, double h_before,
                       double noise) {
  const auto& p = system.particles;
  const double distance = mean_distance(system);
  double most = 0, strongest = 0;  // of |a − a⁻|²/length², |a|²
  Id worst = 0;
  for (Id i = 0; i < p.size(); ++i) {
    if (!p.owns(i)) continue;
    strongest = std::max(strongest, a[i].squaredNorm());
    const double length = length_of_error(p.radius[i], distance);
    const double change = (a[i] - a_before[i]).squaredNorm(), relative = change / (length * length);
    if (change <= noise * noise || !(relative > most)) continue;
    most = relative;
    worst = i;
  }
  std::array<double, 2> largest{most, strongest};
  system.decomposition.ranks().largest(largest);
  const double all = largest[0];
  LocalError error{.rate = std::sqrt(all) / (6 * (h + h_before)), .strongest = std::sqrt(largest[1])};
  constexpr double kNone = -std::numeric_limits<double>::infinity();
  if (all > 0)  // the smallest id of the worst particles
    error.id =
        static_cast<Id>(-system.decomposition.largest(most == all ? -static_cast<double>(p.id_of(worst)) : kNone));
  return error;
}

/// A local error may be this many times the accuracy asked for, or the step is repeated: it is twice too long then.
inline constexpr double kMostError = 8;

/// Throws StepTooLong if a slab of this length is not accurate enough; `error` is of a piece of the length `piece`.
inline void need_accuracy(const LocalError& error, double accuracy, double piece, double length) {
  if (accuracy > 0 && !(error.of(piece) <= kMostError * accuracy)) throw StepTooLong{0.5 * length, error.id};
}

}  // namespace carom
