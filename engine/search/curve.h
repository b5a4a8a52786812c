// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Orders positions along a space-filling curve: neighbours on the curve are close in space (Morton).

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "engine/base/vec.h"

namespace carom {

/// Interleaves the bits of D numbers to the index on the curve.
template <int D>
std::uint64_t interleave(const std::array<std::uint32_t, D>& place) {
  std::uint64_t code = 0;
  for (int bit = 20; bit >= 0; --bit)
    for (int k = 0; k < D; ++k) code = code << 1 | (place[k] >> bit & 1);
  return code;
}

/// The indices of n positions x(i) in the order of a space-filling curve.
template <int D, class Place>
std::vector<std::uint32_t> along_curve(std::size_t n, Place&& x) {
  std::vector<std::uint32_t> order(n);
  if (n == 0) return order;
  Vec<D> low = x(0), high = low;
  for (std::size_t i = 0; i < n; ++i) low = low.cwiseMin(x(i)).eval(), high = high.cwiseMax(x(i)).eval();
  const double scale = ((1 << 20) - 1) / std::max((high - low).maxCoeff(), 1e-300);
  std::vector<std::pair<std::uint64_t, std::uint32_t>> places(n);
  for (std::size_t i = 0; i < n; ++i) {
    std::array<std::uint32_t, D> place;
    for (int k = 0; k < D; ++k) place[k] = static_cast<std::uint32_t>((x(i)[k] - low[k]) * scale);
    places[i] = {interleave<D>(place), static_cast<std::uint32_t>(i)};
  }
  std::sort(places.begin(), places.end());
  for (std::size_t i = 0; i < n; ++i) order[i] = places[i].second;
  return order;
}

}  // namespace carom
