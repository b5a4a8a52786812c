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
  auto outgoing = messages_of_records(static_cast<std::size_t>(ranks.size()), sizeof(Copy), [&](auto&& send) {
    for (Id i = 0; i < block.size(); ++i)
      bisection.for_each_near(bisection.wrapped(block.x[i]), [&](std::uint32_t rank) {
        send(rank, [&](Bytes& to) {
          put(to, Copy{block.x[i], block.v[i], block.radius[i], block.fixed(i) ? block.mass[i] : 1, block.id_of(i),
                       block.species[i]});
        });
      });
  });
  std::vector<Bytes> incoming = ranks.swap(std::move(outgoing));  // by rank, so in the order of ids
  std::size_t bytes = 0;
  for (const Bytes& message : incoming) bytes += message.size();
  Particles<D> halo;
  const auto reserve = [&](auto&... arrays) { (arrays.reserve(bytes / sizeof(Copy)), ...); };
  reserve(halo.x, halo.v, halo.radius, halo.species, halo.mass, halo.id, halo.ghost);
  for (Bytes& message : incoming) {
    for (Reader reader(message); reader.more();) {
      const auto copy = reader.get<Copy>();
      halo.x.push_back(copy.x);
      halo.v.push_back(copy.v);
      halo.radius.push_back(copy.radius);
      halo.species.push_back(copy.species);
      halo.mass.push_back(copy.mass);
      halo.id.push_back(copy.id);
      halo.ghost.push_back(bisection.owner(bisection.wrapped(copy.x)) != static_cast<std::uint32_t>(ranks.rank()));
    }
    Bytes().swap(message);
  }
  return halo;
}

}  // namespace carom
