// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Counter-based random numbers: (seed, purpose, id, index) determines the number on every machine, for any number of
// ranks and any order of calls. There is no state to store.
//
//   RandomStream random(seed, RandomPurpose::velocity, id);
//   const double u = random.uniform();   // in (0, 1)
//
// Philox 4x32 with ten rounds (Salmon, Moraes, Dror, Shaw, SC11 (2011), doi 10.1145/2063384.2063405).

#include <array>
#include <cstdint>

#include "engine/base/normal_deviates.h"

namespace carom {

/// The Philox 4x32-10 bijection: maps a 128-bit counter and a 64-bit key to 128 random bits.
constexpr std::array<std::uint32_t, 4> philox4x32(std::array<std::uint32_t, 4> counter,
                                                  std::array<std::uint32_t, 2> key) {
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t a = std::uint64_t{0xD2511F53} * counter[0];
    const std::uint64_t b = std::uint64_t{0xCD9E8D57} * counter[2];
    counter = {static_cast<std::uint32_t>(b >> 32) ^ counter[1] ^ key[0], static_cast<std::uint32_t>(b),
               static_cast<std::uint32_t>(a >> 32) ^ counter[3] ^ key[1], static_cast<std::uint32_t>(a)};
    key[0] += 0x9E3779B9;
    key[1] += 0xBB67AE85;
  }
  return counter;
}

/// The purpose of a stream of numbers; streams with different purposes are independent. The values are part of the
/// meaning of a seed and never change.
enum class RandomPurpose : std::uint32_t {
  position = 1,
  velocity = 2,
  species = 3,
  probe = 4,
  compression = 5,
  rescaling = 6,
  kick_time = 7,
  kick = 8,
  thermal_wall = 9,
  spin = 10
};

/// The numbers of one purpose and one id, in sequence.
class RandomStream {
 public:
  /// Begins with the number 2·`block`.
  RandomStream(std::uint64_t seed, RandomPurpose purpose, std::uint32_t id, std::uint64_t block = 0)
      : key_{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)},
        purpose_(static_cast<std::uint32_t>(purpose)),
        id_(id),
        index_(2 * block) {}

  std::uint64_t bits() {
    if (index_ % 2 == 0) {
      const std::uint64_t block = index_ / 2;
      block_ =
          philox4x32({static_cast<std::uint32_t>(block), static_cast<std::uint32_t>(block >> 32), id_, purpose_}, key_);
    }
    const std::size_t half = 2 * (index_++ % 2);
    return std::uint64_t{block_[half]} << 32 | block_[half + 1];
  }

  /// Uniform in the open interval (0, 1), 52 random bits.
  double uniform() { return (static_cast<double>(bits() >> 12) + 0.5) * 0x1p-52; }

  /// Uniform in 0 … n − 1, n > 0. (Lemire, ACM Trans. Model. Comput. Simul. 29 (2019) 3.)
  std::uint32_t below(std::uint32_t n) {
    const std::uint32_t unfair = -n % n;  // rejects 2^32 mod n low products, which occur too often
    while (true) {
      const std::uint64_t product = (bits() >> 32) * n;
      if (static_cast<std::uint32_t>(product) >= unfair) return static_cast<std::uint32_t>(product >> 32);
    }
  }

  /// Two independent normal numbers of mean 0 and variance 1.
  std::array<double, 2> normal_pair() {
    const double u = uniform(), turn = uniform();
    return normal_deviates(u, turn);
  }

 private:
  std::array<std::uint32_t, 2> key_;
  std::uint32_t purpose_, id_;
  std::uint64_t index_;
  std::array<std::uint32_t, 4> block_{};
};

}  // namespace carom
