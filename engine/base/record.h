// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The event core's record of a sphere, and the packed form of a neighbour.

#include <algorithm>
#include <bit>
#include <cstddef>

#include "engine/base/error.h"
#include "engine/base/vec.h"

namespace carom {

/// The index of a particle in the core's arrays. Ids never change; slots change whenever the core sorts its particles.
using Slot = std::uint32_t;

/// The state of a sphere right after its last event. One cache line; the kernels of scan.h rely on the layout.
template <int D>
struct alignas(64) Record {
  Vec<D> x;  ///< not wrapped within a slab
  Vec<D> v;
  double t;  ///< time of the last event, since the start of the slab
  Id id;
  std::uint16_t generation;
  std::uint16_t species;
};
static_assert(sizeof(Record<3>) == 64 && offsetof(Record<3>, v) == 24 && offsetof(Record<3>, t) == 48);
static_assert(sizeof(Record<2>) == 64 && offsetof(Record<2>, v) == 16 && offsetof(Record<2>, t) == 32);

/// The capacity of a core that starts with this many records and may admit more.
constexpr std::size_t records_room(std::size_t records) { return records + records / 4 + 256; }

/// The error for an image that does not fit into the bits of a candidate.
[[noreturn]] inline void throw_too_far() {
  throw Error(Failure::numerical,
              "spheres fly through too many periodic boxes in one epoch; give integrator.step a smaller value");
}

/// A candidate for a contact in 31 bits: the slot in the low bits, above it the image with a few bits for each axis;
/// the last bit is free for lists of candidates. `linear` maps an image to one integer, linear in the image.
template <int D>
class Packing {
 public:
  Packing() = default;
  /// For a core with this many slots in a system with this many particles.
  Packing(std::size_t slots, std::size_t particles) {
    slot_bits = bits(slots);
    field_bits = bits_left(slots);
    if (field_bits < 2) throw Error(Failure::deck, "too many particles for one event core");
    const int of_ranks = bits_left(std::min(records_room(particles), std::size_t{1} << 24));
    largest_ = (1 << (std::min(field_bits, of_ranks) - 1)) - 1;
    slot_mask = (std::uint32_t{1} << slot_bits) - 1;
    for (int k = 0; k < D; ++k) bias |= 1 << (field_bits * (k + 1) - 1);
  }

  /// The largest number of boxes an image may be away along an axis; it does not depend on the number of ranks.
  std::int32_t largest() const { return largest_; }
  bool fits(const Image<D>& image) const {
    return std::all_of(image.begin(), image.end(), [&](auto n) { return std::abs(n) <= largest(); });
  }
  std::int32_t linear(const Image<D>& image) const {
    std::int32_t sum = 0;
    for (int k = 0; k < D; ++k) sum += image[k] * (1 << (field_bits * k));
    return sum;
  }
  std::uint32_t pack(Slot slot, std::int32_t linear_image) const {
    return slot | static_cast<std::uint32_t>(linear_image + bias) << slot_bits;
  }
  Slot slot(std::uint32_t candidate) const { return candidate & slot_mask; }
  std::int32_t linear(std::uint32_t candidate) const {
    return static_cast<std::int32_t>(candidate >> slot_bits) - bias;
  }
  Image<D> image(std::uint32_t candidate) const {
    Image<D> image;
    const std::uint32_t code = candidate >> slot_bits;
    for (int k = 0; k < D; ++k)
      image[k] =
          static_cast<std::int32_t>(code >> (field_bits * k) & ((1u << field_bits) - 1)) - (1 << (field_bits - 1));
    return image;
  }
  /// Packs this pair as its other partner does, seen from `self`.
  std::uint32_t reversed(Slot self, std::uint32_t candidate) const { return pack(self, -linear(candidate)); }

  int slot_bits = 1, field_bits = 2;
  std::uint32_t slot_mask = 1;
  std::int32_t bias = 0;

 private:
  static int bits(std::size_t slots) { return std::max(1, static_cast<int>(std::bit_width(slots))); }
  static int bits_left(std::size_t slots) { return std::min(10, (31 - bits(slots)) / D); }
  std::int32_t largest_ = 1;
};

}  // namespace carom
