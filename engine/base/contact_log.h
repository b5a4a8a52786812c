// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A collision as observers see it.

#include <compare>
#include <string>
#include <utility>

#include "engine/base/wall.h"

namespace carom {

enum class EventKind : std::uint8_t { pair = 0, wall = 1 };

/// Total order of events: the same on every machine and for every decomposition. `generation` orders what happens at
/// one instant: 1 + the larger generation of the partners' records where these are of the same time, else 0.
template <int D>
struct EventKey {
  double time = 0;  ///< since the start of the slab or epoch
  std::uint32_t generation = 0;
  EventKind kind = EventKind::pair;
  Id lo = 0;  ///< the lower id; at a wall: the particle
  Id hi = 0;  ///< the higher id; at a wall: its number
  Image<D> image{};
  auto operator<=>(const EventKey&) const = default;
};

/// The key of a contact between two spheres, the first at x_first − x_second + shift(image) from the second.
template <int D>
EventKey<D> pair_key(double time, std::uint32_t generation, Id first, Id second, Image<D> image) {
  if (second < first) {
    std::swap(first, second);
    for (auto& k : image) k = -k;
  }
  return {.time = time, .generation = generation, .lo = first, .hi = second, .image = image};
}

/// Whether two events have the same partners, whenever they happen.
template <int D>
bool same_partners(const EventKey<D>& a, const EventKey<D>& b) {
  return a.kind == b.kind && a.lo == b.lo && a.hi == b.hi && a.image == b.image;
}

/// Names the partners for messages: "particles 3 and 7", "particle 3 and the upper wall of axis 1".
template <int D>
std::string partners(const EventKey<D>& key) {
  const std::string lo = std::to_string(key.lo);
  if (key.kind == EventKind::pair) return "particles " + lo + " and " + std::to_string(key.hi);
  return "particle " + lo + " and " + wall_name(key.hi);
}

/// One executed collision.
template <int D>
struct Contact {
  EventKey<D> key;
  Vec<D> x_lo, x_hi;   ///< centres at contact [length]; x_hi is shifted to the image that is touched; at a wall: the
                       ///< point touched
  Vec<D> impulse;      ///< given to `lo`, taken from `hi` [mass·length/time]
  double virial = 0;   ///< (x_lo − x_hi)·impulse of a pair, as it was computed; of a wall its work [energy]
  double overlap = 0;  ///< at contact, relative to the contact distance; where the method knows it
};

}  // namespace carom
