// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The lists of candidates of all spheres, in one array.
//
// A list starts and ends at multiples of kScanLanes and is padded with the sphere itself; it begins with the
// candidates in the same periodic box. A list that outgrows its block moves to a larger one; free blocks are reused.

#include <algorithm>
#include <limits>
#include <span>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/pages.h"
#include "engine/search/next_event.h"
#include "engine/search/simd/scan.h"

namespace carom {

template <int D>
class CandidateLists {
 public:
  /// The start and the length of each sphere's list are stored in `next_events`.
  CandidateLists(const Packing<D>& packing, PageVector<NextEvent<D>>& next_events)
      : packing_(packing), next_events_(next_events) {}

  const std::uint32_t* of(const NextEvent<D>& a) const { return &pool_[std::size_t{kScanLanes} * a.list]; }
  std::uint32_t* of(const NextEvent<D>& a) { return &pool_[std::size_t{kScanLanes} * a.list]; }

  /// Removes all lists and reserves memory for the lists of n spheres, whose capacities the caller has set to 0.
  void clear(std::size_t n) {
    pool_.clear();
    used_ = 0;
    pool_.reserve(24 * n);
    for (auto& unused : unused_) unused.clear();
  }

  /// Stores these candidates as the list of a sphere.
  void assign(Slot i, std::span<const std::uint32_t> candidates) {
    NextEvent<D>& a = next_events_[i];
    const auto n = static_cast<unsigned>(candidates.size());
    const unsigned units = (n + kSpareRoom + kScanLanes - 1) / kScanLanes;
    if (n > kScanLanes * a.capacity || a.capacity == 0) {
      if (units > std::numeric_limits<std::uint16_t>::max() / kScanLanes)
        throw Error(Failure::numerical, "a sphere has more than 65 thousand neighbours");
      if (a.capacity > 0) unused_[a.capacity].push_back(a.list);
      a.list = allocate(units);
      a.capacity = static_cast<std::uint16_t>(units);
    }
    std::uint32_t* const list = of(a);
    std::fill(std::ranges::copy(candidates, list).out, list + std::size_t{kScanLanes} * a.capacity,
              packing_.pack(i, 0));
    a.count = static_cast<std::uint16_t>(n);
    divide(a);
  }

  /// Moves the candidates in the same box to the start of a list.
  void divide(NextEvent<D>& a) {
    std::uint32_t* const list = of(a);
    const auto* const others = std::partition(list, list + a.count, [&](auto c) { return same_box(c); });
    a.same = static_cast<std::uint16_t>(others - list);
  }

  void add(Slot i, std::uint32_t candidate) {
    NextEvent<D>& a = next_events_[i];
    std::uint32_t* list = of(a);
    if (a.count == kScanLanes * a.capacity) {
      std::vector<std::uint32_t> longer(list, list + a.count);
      longer.push_back(candidate);
      assign(i, longer);
      return;
    }
    list[a.count] = candidate;
    if (same_box(candidate)) std::swap(list[a.same++], list[a.count]);
    ++a.count;
  }

  /// Removes a candidate from the list of a sphere.
  void drop(Slot i, std::uint32_t candidate) {
    const std::uint32_t* const list = of(next_events_[i]);
    remove(i, static_cast<unsigned>(std::find(list, list + next_events_[i].count, candidate) - list));
  }
  /// Removes the candidate at index q; a later candidate moves to this index.
  void remove(Slot i, unsigned q) {
    NextEvent<D>& a = next_events_[i];
    if (q == a.count) return;
    std::uint32_t* const list = of(a);
    if (q < a.same) {
      list[q] = list[--a.same];
      q = a.same;
    }
    list[q] = list[--a.count];
    list[a.count] = packing_.pack(i, 0);
  }

 private:
  static constexpr unsigned kSpareRoom = 3;  // spare entries of a new list

  bool same_box(std::uint32_t candidate) const { return packing_.linear(candidate) == 0; }
  std::uint32_t allocate(unsigned units) {
    if (unused_.size() <= units) unused_.resize(units + 1);
    if (!unused_[units].empty()) {
      const std::uint32_t list = unused_[units].back();
      unused_[units].pop_back();
      return list;
    }
    const std::size_t at = used_;
    used_ += std::size_t{kScanLanes} * units;
    pool_.resize(used_ + 8);  // lists are compared in blocks of eight
    return static_cast<std::uint32_t>(at / kScanLanes);
  }

  Packing<D> packing_;
  PageVector<NextEvent<D>>& next_events_;
  PageVector<std::uint32_t> pool_;
  std::size_t used_ = 0;                            // length of the pool in use
  std::vector<std::vector<std::uint32_t>> unused_;  // free blocks, by capacity
};

}  // namespace carom
