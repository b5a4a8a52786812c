// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A hash of the events of each particle in a slab: two ranks with equal hashes computed the same events.

#include <bit>
#include <vector>

#include "engine/base/particles.h"
#include "engine/laws/contact_log.h"

namespace carom {

/// Adds a word to a hash.
inline void add_to_hash(std::uint64_t& hash, std::uint64_t word) {
  hash = (hash ^ word) * 0x9e3779b97f4a7c15;
  hash ^= hash >> 32;
}

/// Adds an event to a hash, with the global ids of its particles.
template <int D>
void add_to_hash(std::uint64_t& hash, const EventKey<D>& key, const Particles<D>& particles) {
  const bool pair = key.kind == EventKind::pair;
  add_to_hash(hash, std::bit_cast<std::uint64_t>(key.time));
  add_to_hash(hash, std::uint64_t{key.generation} << 1 | (pair ? 1 : 0));
  add_to_hash(hash, std::uint64_t{particles.id_of(key.lo)} << 32 | (pair ? particles.id_of(key.hi) : key.hi));
  for (int k = 0; k < D; ++k) add_to_hash(hash, static_cast<std::uint64_t>(key.image[k]));
}

/// Hashes of the events of all particles; add the events in their order.
template <int D>
class PathHashes {
 public:
  explicit PathHashes(const Particles<D>& particles) : particles_(particles), words_(particles.size()) {}
  void add(const EventKey<D>& key) {
    add_to_hash(words_[key.lo], key, particles_);
    if (key.kind == EventKind::pair) add_to_hash(words_[key.hi], key, particles_);
  }
  /// The hashes, by particle.
  const std::vector<std::uint64_t>& words() const { return words_; }

 private:
  const Particles<D>& particles_;
  std::vector<std::uint64_t> words_;
};

}  // namespace carom
