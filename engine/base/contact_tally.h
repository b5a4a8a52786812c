// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Counts and sums over executed contacts. The tallies of several ranks can be added.

#include <algorithm>
#include <string>
#include <vector>

#include "engine/base/contact_log.h"
#include "engine/base/exact_sum.h"

namespace carom {

struct ContactTally {
  std::uint64_t sphere_sphere = 0;  ///< executed pair collisions
  std::uint64_t sphere_wall = 0;    ///< executed wall collisions
  double max_overlap = 0;           ///< deepest overlap at a contact, relative to the contact distance
  ExactSum collision_virial;        ///< Σ d·impulse over pair collisions [mass·length²/time]
  ExactSum dissipated;              ///< energy lost at contacts [energy]
  ExactSum work;                    ///< work done on spheres by moving walls [energy]
  ExactSum heat;                    ///< energy that spheres got from walls and baths with a temperature [energy]

  /// What kinetic and potential energy have lost to the surroundings: H + drained() is conserved.
  double drained() const { return dissipated.value() - work.value() - heat.value(); }

  std::uint64_t contacts() const { return sphere_sphere + sphere_wall; }
  /// `virial`: the virial of a pair, or the work of a wall.
  void add(EventKind kind, double virial, double overlap) {
    ++(kind == EventKind::pair ? sphere_sphere : sphere_wall);
    (kind == EventKind::pair ? collision_virial : work).add(virial);
    max_overlap = std::max(max_overlap, overlap);
  }
  void add(const ContactTally& other) {
    sphere_sphere += other.sphere_sphere;
    sphere_wall += other.sphere_wall;
    max_overlap = std::max(max_overlap, other.max_overlap);
    collision_virial.add(other.collision_virial);
    dissipated.add(other.dissipated);
    work.add(other.work);
    heat.add(other.heat);
  }
  /// Counts a contact and appends it to `log` unless `log` is null.
  template <int D>
  void record(const Contact<D>& contact, std::vector<Contact<D>>* log) {
    add(contact.key.kind, contact.virial, contact.overlap);
    if (log) log->push_back(contact);
  }
};

/// Throws the error for a step with more contacts than `most`; `last` names the partners of the last one, if known.
[[noreturn]] void throw_too_many_contacts(std::uint64_t most, const std::string& last = "");

}  // namespace carom
