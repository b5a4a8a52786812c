// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Converts a list of pairs to the partners of each particle.

#include <array>
#include <span>
#include <vector>

#include "engine/base/vec.h"

namespace carom {

/// The partners of each particle in a list of pairs, with the indices of the pairs. Pairs must have i < j and be in
/// ascending order; partners are then in the order of their ids, too.
class Partners {
 public:
  struct Partner {
    Id id;
    std::uint32_t pair;
  };

  bool empty() const { return start_.empty(); }
  void clear() { start_.clear(); }

  /// ids(k) returns the two ids of pair k.
  template <class Ids>
  void build(std::size_t particles, std::size_t pairs, Ids&& ids) {
    start_.assign(particles + 2, 0);  // while filling, start_[i + 1] is the index of i's next partner
    for (std::size_t k = 0; k < pairs; ++k)
      for (const Id id : ids(k)) ++start_[id + 2];
    for (std::size_t i = 0; i < particles; ++i) start_[i + 2] += start_[i + 1];
    partner_.resize(2 * pairs);
    for (std::size_t k = 0; k < pairs; ++k) {
      const auto [i, j] = ids(k);
      partner_[start_[i + 1]++] = {j, static_cast<std::uint32_t>(k)};
      partner_[start_[j + 1]++] = {i, static_cast<std::uint32_t>(k)};
    }
  }

  std::span<const Partner> of(Id i) const { return {partner_.data() + start_[i], start_[i + 1] - start_[i]}; }

 private:
  std::vector<std::uint32_t> start_;
  std::vector<Partner> partner_;
};

}  // namespace carom
