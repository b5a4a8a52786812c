// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Radii and masses of all spheres of a system, on every rank: one for each species or, if spheres of a species differ,
// one for each sphere.

#include <algorithm>
#include <cstdint>
#include <vector>

#include "engine/base/particles.h"
#include "engine/base/record.h"

namespace carom {

struct Sizes {
  std::size_t spheres = 0;           ///< total number of spheres
  bool by_species = false;           ///< indexed by species, else by id
  std::vector<double> radius, mass;  ///< for each species or sphere
  std::vector<double> number;        ///< number of spheres of each species; empty if indexed by id

  Sizes() = default;
  /// For a system with all particles on this rank.
  template <int D>
  Sizes(const Particles<D>& all) : spheres(all.radius.size()) {
    const std::size_t species = spheres > 0 ? *std::ranges::max_element(all.species) + std::size_t{1} : 0;
    radius.resize(species);
    mass.resize(species);
    number.resize(species);
    for (std::size_t i = 0; i < spheres; ++i) {
      const std::uint16_t s = all.species[i];
      by_species = mass[s] == 0 || (radius[s] == all.radius[i] && mass[s] == all.mass[i]);
      if (!by_species) break;
      radius[s] = all.radius[i];
      mass[s] = all.mass[i];
      number[s] += 1;
    }
    if (by_species) return;
    number.clear();
    radius = all.radius;
    mass = all.mass;
  }

  double radius_of(Id id, std::uint16_t species) const { return radius[by_species ? species : id]; }
  double mass_of(Id id, std::uint16_t species) const { return mass[by_species ? species : id]; }
  template <int D>
  double radius_of(const Record<D>& r) const {
    return radius_of(r.id, r.species);
  }
  template <int D>
  double mass_of(const Record<D>& r) const {
    return mass_of(r.id, r.species);
  }
  double largest_radius() const { return *std::ranges::max_element(radius); }
};

}  // namespace carom
