#pragma once
// What happened to each particle in a slab, in a word: two ranks that have it from the same start agree on all of it.

#include <bit>
#include <vector>

#include "engine/contact_log.h"
#include "engine/particles.h"

namespace carom::integrator {

/// Takes a word into a digest.
inline void mix(std::uint64_t& digest, std::uint64_t word) {
  digest = (digest ^ word) * 0x9e3779b97f4a7c15;
  digest ^= digest >> 32;
}

/// Takes an event into a digest, with the ids that all ranks know.
template <int D>
void mix(std::uint64_t& digest, const EventKey<D>& key, const Particles<D>& particles) {
  const bool pair = key.kind == EventKind::pair;
  mix(digest, std::bit_cast<std::uint64_t>(key.time));
  mix(digest, std::uint64_t{key.generation} << 1 | (pair ? 1 : 0));
  mix(digest, std::uint64_t{particles.id_of(key.lo)} << 32 | (pair ? particles.id_of(key.hi) : key.hi));
  for (int k = 0; k < D; ++k) mix(digest, static_cast<std::uint64_t>(key.image[k]));
}

/// Of the events of each particle, given in their order.
template <int D>
class Digest {
 public:
  explicit Digest(const Particles<D>& particles) : particles_(particles), words_(particles.size()) {}
  void add(const EventKey<D>& key) {
    mix(words_[key.lo], key, particles_);
    if (key.kind == EventKind::pair) mix(words_[key.hi], key, particles_);
  }
  std::uint64_t operator[](Id i) const { return words_[i]; }

 private:
  const Particles<D>& particles_;
  std::vector<std::uint64_t> words_;
};

}  // namespace carom::integrator
