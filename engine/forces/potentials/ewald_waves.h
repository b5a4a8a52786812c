// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The waves of an Ewald sum, and e^(ik·x) for each of them.

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "engine/base/elementary.h"
#include "engine/forces/potentials/ewald.h"
#include "engine/forces/simd/wave_kernels.h"

namespace carom {

/// Cosine and sine of 2πu, |u| < 2^50, with errors of an ulp or two: their Taylor series within an eighth of a turn.
inline std::array<double, 2> turn(double u) {
  const double quarters = std::nearbyint(4 * u), y = 2 * std::numbers::pi * (u - 0.25 * quarters), y2 = y * y;
  double sin = 1, cos = 1;
  for (int n = 16; n > 0; n -= 2) {
    sin = 1 - y2 * (1.0 / (n * (n + 1))) * sin;
    cos = 1 - y2 * (1.0 / (n * (n - 1))) * cos;
  }
  sin *= y;
  switch (static_cast<std::int64_t>(quarters) & 3) {
    case 0:
      return {cos, sin};
    case 1:
      return {-sin, cos};
    case 2:
      return {-cos, -sin};
    default:
      return {sin, -cos};
  }
}

/// The numbers e^(2πi n u), n = −most … most.
class Phases {
 public:
  explicit Phases(int most) : most_(most), re_(2 * most + 1 + WaveRow::kMultiple), im_(re_.size()) {}

  /// From cosine and sine of 2πu.
  void set(const std::array<double, 2>& of_u) {
    const auto [cos, sin] = of_u;
    re_[most_] = 1;
    im_[most_] = 0;
    for (int n = 1; n <= most_; ++n) {
      const double re = re_[most_ + n - 1], im = im_[most_ + n - 1];
      re_[most_ + n] = re * cos - im * sin;
      im_[most_ + n] = re * sin + im * cos;
      re_[most_ - n] = re_[most_ + n];
      im_[most_ - n] = -im_[most_ + n];
    }
  }
  const double* re() const { return re_.data() + most_; }  // of n = 0
  const double* im() const { return im_.data() + most_; }

 private:
  int most_;
  std::vector<double> re_, im_;
};

/// The vectors k = 2π (a/L_x, b/L_y, ±c/L_z) with 0 < |k| ≤ k_c, one of k and −k, in rows of consecutive c (see
/// wave_kernels.h). With the amplitudes S of Σ_j q_j e^(ik·x_j), the energy of an entry is `weight` Σ S² over its four
/// products: 2 (C/2Ω) (4π/k²) e^(−k²/4α²) |S(k)|² for each of its waves.
struct Waves {
  /// Rows that fit into the first level of cache with the amplitudes of one kind.
  struct Part {
    std::size_t first, n;
  };
  std::array<int, 3> most;  // largest |a|, |b|, |c|
  Vec<3> edges, unit;       // L, 2π/L
  double longest;           // k_c
  std::vector<WaveRow> rows;
  std::vector<Part> parts;
  std::vector<double> weight;   // of each entry; padding and k = 0 have 0
  std::vector<double> squared;  // k²

  Waves(const EwaldSplit& split, const Vec<3>& repeated, double constant)
      : edges(repeated), longest(split.wave_cutoff) {
    constexpr unsigned kEntries = 512;  // of a part: 16 KB, half of the first level of most processors
    const double volume = edges.prod();
    for (int k = 0; k < 3; ++k) {
      unit[k] = 2 * std::numbers::pi / edges[k];
      most[k] = static_cast<int>(std::min(longest / unit[k], 1e6));
    }
    for (int a = 0; a <= most[0]; ++a)
      for (int b = a == 0 ? 0 : -most[1]; b <= most[1]; ++b) {
        const double flat = unit[0] * unit[0] * a * a + unit[1] * unit[1] * b * b;
        if (flat > longest * longest) continue;
        const int end = static_cast<int>(std::sqrt(longest * longest - flat) / unit[2]);
        const auto first = static_cast<unsigned>(weight.size()), count = static_cast<unsigned>(end + 1);
        const unsigned padded = (count + WaveRow::kMultiple - 1) / WaveRow::kMultiple * WaveRow::kMultiple;
        if (parts.empty() || first + padded - rows[parts.back().first].first > kEntries)
          parts.push_back({rows.size(), 0});
        ++parts.back().n;
        rows.push_back({a, b, first, padded});
        for (int c = 0; c <= end; ++c) {
          const double k2 = flat + unit[2] * unit[2] * c * c, waves = flat > 0 && c > 0 ? 2 : 1;
          squared.push_back(k2);
          weight.push_back(k2 > 0 ? waves * constant / volume * 4 * std::numbers::pi / k2 *
                                        elementary::exp(-k2 / (4 * split.alpha * split.alpha))
                                  : 0.0);
        }
        weight.resize(first + padded, 0.0);
        squared.resize(first + padded, 0.0);
      }
  }
  std::size_t size() const { return weight.size(); }
};

/// One number for each product of each entry; see place_of().
using Amplitudes = std::vector<double>;

/// sin(y)/y
inline double sinc(double y) { return y == 0 ? 1 : turn(y / (2 * std::numbers::pi))[1] / y; }

}  // namespace carom
