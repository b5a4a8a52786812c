// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Blocks of consecutive ids, one for each rank: the order of particles in files and between epochs.

#include <cstring>
#include <span>
#include <vector>

#include "engine/base/particles.h"
#include "engine/ranks/communicator.h"

namespace carom {

struct IdBlocks {
  std::size_t particles = 0, ranks = 1;

  /// The first id of a rank's block, which ends where the next block begins.
  Id first(int rank) const { return static_cast<Id>(particles * static_cast<std::size_t>(rank) / ranks); }
  int rank_of(Id id) const {
    auto rank = static_cast<int>(id * ranks / particles);
    while (first(rank + 1) <= id) ++rank;
    return rank;
  }
};

/// Sends data of particles, `size` bytes each, to the ranks of their blocks: for_each(send) calls send(id, write) for
/// each particle on one of the ranks, and write(message) appends its data; for_each() is called twice. take(place,
/// bytes) is called on the rank of its block, place being the index in the block. Collective.
void to_id_blocks(const IdBlocks& blocks, Communicator& ranks, std::size_t size, auto&& for_each, auto&& take) {
  auto outgoing = messages_of_records(blocks.ranks, sizeof(Id) + size, [&](auto&& send) {
    for_each([&](Id id, auto&& write) {
      send(static_cast<std::size_t>(blocks.rank_of(id)), [&](Bytes& to) {
        put(to, id);
        write(to);
      });
    });
  });
  const Id first = blocks.first(ranks.rank());
  for (const Bytes& bytes : ranks.swap(std::move(outgoing)))
    for (Reader reader(bytes); reader.more();) {
      const auto id = reader.get<Id>();
      take(id - first, reader.skip(size));
    }
}

/// Calls visit(vector) for all arrays of the particles except id and ghost.
template <int D, class Visit>
void for_each_array(Particles<D>& p, Visit&& visit) {
  visit(p.x);
  visit(p.v);
  visit(p.image);
  visit(p.mass);
  visit(p.radius);
  visit(p.charge);
  visit(p.species);
  p.for_each_internal([&](auto& array, auto) { visit(array); });
}

/// Sends the messages of all ranks to rank 0, one rank at a time, to limit its memory. Each rank calls pack() for its
/// message; rank 0 calls visit(rank, message). Collective.
template <class Pack, class Visit>
void one_after_the_other(Communicator& ranks, Pack&& pack, Visit&& visit) {
  for (int rank = 0; rank < ranks.size(); ++rank) {
    const auto received = gather_on_first(ranks, rank == ranks.rank() ? pack() : Bytes());
    if (ranks.rank() == 0) visit(rank, received[static_cast<std::size_t>(rank)]);
  }
}

/// Copies of all particles on rank 0, by id, from the blocks of all ranks; empty on other ranks. Collective.
template <int D>
Particles<D> gathered(Communicator& ranks, const Particles<D>& block) {
  Archive mine;
  for_each_array(const_cast<Particles<D>&>(block), [&](auto& array) { mine(array); });
  Particles<D> all;
  for (Bytes& bytes : gather_on_first(ranks, mine.bytes())) {
    if (bytes.empty()) continue;
    Archive from(std::move(bytes));
    for_each_array(all, [&](auto& array) {
      std::remove_reference_t<decltype(array)> part;
      from(part);
      array.insert(array.end(), part.begin(), part.end());
    });
  }
  return all;
}

}  // namespace carom
