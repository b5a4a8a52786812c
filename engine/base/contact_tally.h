// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Counts and sums over executed contacts. The tallies of several ranks can be added.

#include <algorithm>
#include <string>
#include <vector>

#include "engine/base/archive.h"
#include "engine/base/contact_log.h"
#include "engine/base/exact_sum.h"

namespace carom {

/// Sums over the contacts with a wall.
struct WallTally {
  std::uint64_t contacts = 0;
  ExactSum impulse;  ///< on spheres, along the normal [mass·length/time]
  ExactSum work;     ///< done on spheres [energy]
  ExactSum heat;     ///< that spheres got [energy]

  void add(const Exchange& of_contact) {
    ++contacts;
    impulse.add(of_contact.impulse);
    work.add(of_contact.work);
    heat.add(of_contact.heat);
  }
  void add(const WallTally& other) {
    contacts += other.contacts;
    impulse.add(other.impulse);
    work.add(other.work);
    heat.add(other.heat);
  }
};

struct ContactTally {
  std::uint64_t sphere_sphere = 0;  ///< executed pair collisions
  std::uint64_t sphere_wall = 0;    ///< executed wall collisions
  std::uint64_t kicks = 0;          ///< kicks by a bath
  double max_overlap = 0;           ///< deepest overlap at a contact, relative to the contact distance
  ExactSum collision_virial;        ///< Σ d·impulse over pair collisions [mass·length²/time]
  ExactSum dissipated;              ///< energy lost at contacts [energy]
  ExactSum work;                    ///< work done on spheres by moving walls [energy]
  ExactSum heat;                    ///< energy that spheres got from walls and baths with a temperature [energy]
  std::vector<WallTally> walls;     ///< by number, as far as walls were hit

  /// What kinetic and potential energy have lost to the surroundings: H + drained() is conserved.
  double drained() const { return dissipated.value() - work.value() - heat.value(); }

  std::uint64_t contacts() const { return sphere_sphere + sphere_wall; }
  /// The sums of a wall.
  WallTally& wall(Id number) {
    if (walls.size() <= number) walls.resize(number + 1);
    return walls[number];
  }
  void add_pair(const Exchange& exchange, double overlap) {
    ++sphere_sphere;
    collision_virial.add(exchange.virial);
    if (exchange.dissipated != 0) dissipated.add(exchange.dissipated);
    max_overlap = std::max(max_overlap, overlap);
  }
  void add_wall(Id number, const Exchange& exchange, double overlap) {
    if (number == Bath::kNumber) {
      ++kicks;
      return heat.add(exchange.heat);
    }
    ++sphere_wall;
    wall(number).add(exchange);
    for (const auto& [sum, term] :
         {std::pair{&work, exchange.work}, {&heat, exchange.heat}, {&dissipated, exchange.dissipated}})
      if (term != 0) sum->add(term);
    max_overlap = std::max(max_overlap, overlap);
  }
  void add(const ContactTally& other) {
    sphere_sphere += other.sphere_sphere;
    sphere_wall += other.sphere_wall;
    kicks += other.kicks;
    max_overlap = std::max(max_overlap, other.max_overlap);
    collision_virial.add(other.collision_virial);
    dissipated.add(other.dissipated);
    work.add(other.work);
    heat.add(other.heat);
    for (std::size_t number = other.walls.size(); number-- > 0;) wall(static_cast<Id>(number)).add(other.walls[number]);
  }
  void archive(Archive& archive) {
    archive(sphere_sphere, sphere_wall, kicks, max_overlap, collision_virial, dissipated, work, heat, walls);
  }
  /// Counts a contact and appends it to `log` unless `log` is null.
  template <int D>
  void record(const Contact<D>& contact, std::vector<Contact<D>>* log) {
    if (contact.key.kind == EventKind::pair)
      add_pair(contact.exchange, contact.overlap);
    else
      add_wall(contact.key.hi, contact.exchange, contact.overlap);
    if (log) log->push_back(contact);
  }
};

/// Throws the error for a step with more contacts than `most`; `last` names the partners of the last one, if known.
[[noreturn]] void throw_too_many_contacts(std::uint64_t most, const std::string& last = "");

}  // namespace carom
