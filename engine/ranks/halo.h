// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Particles distributed by place, with copies of nearby ones on each rank.

#include <algorithm>
#include <utility>
#include <vector>

#include "engine/base/particles.h"
#include "engine/ranks/bisection.h"
#include "engine/ranks/communicator.h"

namespace carom {

/// From blocks of all particles, `block` on this rank, makes the particles of this rank's subdomain and, as ghosts,
/// copies of particles within `distance` of it up to rounding. Only x, v, radius, species, id, ghost and, as 1
/// or infinite, mass are set. Collective.
template <int D>
Particles<D> halo_of(const Box<D>& box, double distance, Communicator& ranks, const Particles<D>& block) {
  struct Copy {
    Vec<D> x, v;
    double radius, mass;
    Id id;
    std::uint16_t species;
  };
  const Bisection<D> bisection(box, block.x, static_cast<std::size_t>(ranks.size()), distance * (1 + 1e-6), ranks);
  std::vector<Bytes> outgoing(static_cast<std::size_t>(ranks.size()));
  for (Id i = 0; i < block.size(); ++i) {
    const Copy copy{block.x[i],     block.v[i],      block.radius[i], block.fixed(i) ? block.mass[i] : 1,
                    block.id_of(i), block.species[i]};
    bisection.for_each_near(bisection.wrapped(copy.x), [&](std::uint32_t rank) { put(outgoing[rank], copy); });
  }
  auto copies = values_in<Copy>(ranks.swap(std::move(outgoing)));
  if (!std::ranges::is_sorted(copies, {}, &Copy::id)) std::ranges::sort(copies, {}, &Copy::id);
  Particles<D> halo;
  for (const Copy& copy : copies) {
    halo.x.push_back(copy.x);
    halo.v.push_back(copy.v);
    halo.radius.push_back(copy.radius);
    halo.species.push_back(copy.species);
    halo.mass.push_back(copy.mass);
    halo.id.push_back(copy.id);
    halo.ghost.push_back(bisection.owner(bisection.wrapped(copy.x)) != static_cast<std::uint32_t>(ranks.rank()));
  }
  return halo;
}

}  // namespace carom
