#pragma once
// Particles sorted by place, to find those near each other where each rank has only some of them.

#include <algorithm>
#include <vector>

#include "engine/base/particles.h"
#include "engine/ranks/division.h"
#include "engine/ranks/exchange.h"

namespace carom {

/// The particles in this rank's part of the box, and copies of those near it; by id, ascending.
template <int D>
struct Vicinity {
  std::vector<Vec<D>> x;
  std::vector<double> radius;
  std::vector<Id> id;
  std::vector<char> beyond;  ///< 1: not in this part, but near it
};

/// Of the particles that all ranks have together, this one its share; near: nearer than `distance`, but for rounding.
/// Collective.
template <int D>
Vicinity<D> vicinity(const Box<D>& box, double distance, Exchange& ranks, const Particles<D>& share) {
  struct Copy {
    Vec<D> x;
    double radius;
    Id id;
  };
  const double reach = distance * (1 + 1e-6);
  const auto size = static_cast<std::size_t>(ranks.size());
  const Division<D> division(box, share.x, size, reach, ranks);
  std::vector<Bytes> outgoing(size);
  for (Id i = 0; i < share.size(); ++i)
    division.for_each_near(division.wrapped(share.x[i]), [&](std::uint32_t rank) {
      put(outgoing[rank], Copy{share.x[i], share.radius[i], share.id_of(i)});
    });
  std::vector<Copy> places;
  for (Bytes& bytes : ranks.swap(std::move(outgoing))) {
    for (Reader reader(bytes); reader.more();) places.push_back(reader.get<Copy>());
    Bytes().swap(bytes);
  }
  std::ranges::sort(places, {}, &Copy::id);
  Vicinity<D> found;
  for (const Copy& place : places) {
    found.x.push_back(place.x);
    found.radius.push_back(place.radius);
    found.id.push_back(place.id);
    found.beyond.push_back(division.owner(division.wrapped(place.x)) != static_cast<std::uint32_t>(ranks.rank()));
  }
  return found;
}

}  // namespace carom
