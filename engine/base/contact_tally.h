// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Executed contacts, counted: one account for all that execute them, which accounts of several ranks are added to.

#include <algorithm>
#include <string>
#include <vector>

#include "engine/base/contact_log.h"
#include "engine/base/exact_sum.h"

namespace carom {

struct ContactTally {
  std::uint64_t sphere_sphere = 0;  ///< executed pair collisions
  std::uint64_t sphere_wall = 0;    ///< executed wall collisions
  double max_overlap = 0;           ///< deepest overlap met, relative to the contact distance
  ExactSum collision_virial;        ///< Σ d·impulse over pair collisions [mass·length²/time]
  ExactSum wall_work;               ///< done on spheres by walls that move [energy]

  std::uint64_t contacts() const { return sphere_sphere + sphere_wall; }
  /// `virial`: of a pair; of a wall its work.
  void add(EventKind kind, double virial, double overlap) {
    ++(kind == EventKind::pair ? sphere_sphere : sphere_wall);
    (kind == EventKind::pair ? collision_virial : wall_work).add(virial);
    max_overlap = std::max(max_overlap, overlap);
  }
  void add(const ContactTally& other) {
    sphere_sphere += other.sphere_sphere;
    sphere_wall += other.sphere_wall;
    max_overlap = std::max(max_overlap, other.max_overlap);
    collision_virial.add(other.collision_virial);
    wall_work.add(other.wall_work);
  }
  /// Counts a contact and appends it to `log`, unless that is null.
  template <int D>
  void record(const Contact<D>& contact, std::vector<Contact<D>>* log) {
    add(contact.key.kind, contact.virial, contact.overlap);
    if (log) log->push_back(contact);
  }
};

/// Throws the error of a step that needs more contacts than it may; `last`: the partners of the last one, where they
/// are known.
[[noreturn]] void throw_too_many_contacts(std::uint64_t most, const std::string& last = "");

}  // namespace carom
