// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Orders positions along a space-filling curve: neighbours on the curve are close in space (Morton).

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "engine/base/vec.h"

namespace carom {

/// Interleaves the lowest 21 bits of D numbers to the index on the curve.
template <int D>
std::uint64_t interleave(const std::array<std::uint32_t, D>& place) {
  // Bit b moves to place D·b: each line moves half of the bits of every group apart.
  const auto spread = [](std::uint64_t x) {
    if constexpr (D == 3) {
      x = (x | x << 32) & 0x001f00000000ffff;
      x = (x | x << 16) & 0x001f0000ff0000ff;
      x = (x | x << 8) & 0x100f00f00f00f00f;
      x = (x | x << 4) & 0x10c30c30c30c30c3;
      return (x | x << 2) & 0x1249249249249249;
    } else {
      x = (x | x << 16) & 0x0000ffff0000ffff;
      x = (x | x << 8) & 0x00ff00ff00ff00ff;
      x = (x | x << 4) & 0x0f0f0f0f0f0f0f0f;
      x = (x | x << 2) & 0x3333333333333333;
      return (x | x << 1) & 0x5555555555555555;
    }
  };
  std::uint64_t code = 0;
  for (int k = 0; k < D; ++k) code = code << 1 | spread(place[k]);
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
