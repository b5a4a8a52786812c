#pragma once
// Which rank keeps which particles of a system that several ranks share: each has those of consecutive ids, its share,
// at the start and whenever the system is observed. Else they are with their owners (domains.h, part.h).

#include <cstring>
#include <span>
#include <vector>

#include "engine/base/particles.h"
#include "engine/base/system.h"
#include "engine/ranks/exchange.h"

namespace carom {

struct Shares {
  std::size_t particles = 0, ranks = 1;

  /// The first id of a rank's share; that of the next rank is its end.
  Id first(int rank) const { return static_cast<Id>(particles * static_cast<std::size_t>(rank) / ranks); }
  int rank_of(Id id) const {
    auto rank = static_cast<int>(id * ranks / particles);
    while (first(rank + 1) <= id) ++rank;
    return rank;
  }
};

/// The ranks that have shares of a system; null: all particles are here.
template <int D>
Exchange* shared_by(const System<D>& system) {
  return system.sizes ? system.ranks : nullptr;
}

/// Calls visit(vector) for everything that is kept of each particle, but for its id and owner.
template <int D, class Visit>
void for_each_array(Particles<D>& p, Visit&& visit) {
  visit(p.x);
  visit(p.v);
  visit(p.image);
  visit(p.mass);
  visit(p.radius);
  visit(p.charge);
  visit(p.species);
}

/// Leaves this rank its share of a system that it has in full.
template <int D>
void keep_share(System<D>& system) {
  Particles<D>& p = system.particles;
  system.sizes.emplace(p);
  const Shares shares{p.size(), static_cast<std::size_t>(system.ranks->size())};
  const Id first = shares.first(system.ranks->rank()), end = shares.first(system.ranks->rank() + 1);
  for_each_array(
      p, [&](auto& all) { all = std::remove_reference_t<decltype(all)>(all.begin() + first, all.begin() + end); });
  for (Id i = first; i < end; ++i) p.id.push_back(i);
}

/// Sends the messages of all ranks to rank 0 one after the other, so that it never holds more than one. pack() makes a
/// rank's message, visit(rank, message) is called on rank 0. Collective.
template <class Pack, class Visit>
void one_after_the_other(Exchange& ranks, Pack&& pack, Visit&& visit) {
  for (int rank = 0; rank < ranks.size(); ++rank) {
    const auto received = gather_on_first(ranks, rank == ranks.rank() ? pack() : Bytes());
    if (ranks.rank() == 0) visit(rank, received[static_cast<std::size_t>(rank)]);
  }
}

/// Copies of all particles on rank 0, by id, from the shares of all ranks; none elsewhere. Collective.
template <int D>
Particles<D> gathered(Exchange& ranks, const Particles<D>& share) {
  Bytes mine;
  for_each_array(const_cast<Particles<D>&>(share), [&](const auto& array) {
    const auto bytes = std::as_bytes(std::span(array));
    mine.insert(mine.end(), bytes.begin(), bytes.end());
  });
  Particles<D> all;
  for (const Bytes& bytes : gather_on_first(ranks, std::move(mine))) {
    std::size_t each = 0;
    for_each_array(all, [&](const auto& array) { each += sizeof(array[0]); });
    const std::size_t n = bytes.size() / each;
    Reader from(bytes);
    for_each_array(all, [&](auto& array) {
      const std::size_t before = array.size();
      array.resize(before + n);
      if (n > 0)
        std::memcpy(static_cast<void*>(array.data() + before), from.skip(n * sizeof(array[0])), n * sizeof(array[0]));
    });
  }
  return all;
}

}  // namespace carom
