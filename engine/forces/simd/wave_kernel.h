// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The loops over waves for vectors of W doubles.

#include "engine/base/lanes.h"
#include "engine/forces/simd/wave_kernels.h"

namespace carom {

template <int W>
struct WaveLoops {
  using V = typename Width<W>::Double;
  static constexpr unsigned kVectors = WaveRow::kMultiple / W;

  /// Calls visit(row, m, vector of the row's eight, re, im) with e^(ik·x) for W waves each.
  template <class Row, class Visit>
  CAROM_INLINE static void for_each(const WaveTask& task, Row&& end_of_row, Visit&& visit) {
    for (std::size_t r = 0; r < task.n; ++r) {
      const WaveRow& row = task.rows[r];
      const double re_a = task.re[0][row.a], im_a = task.im[0][row.a], re_b = task.re[1][row.b],
                   im_b = task.im[1][row.b];
      const double re_ab = re_a * re_b - im_a * im_b, im_ab = re_a * im_b + im_a * re_b;
      for (unsigned m = 0; m < row.count; m += WaveRow::kMultiple)
        for (unsigned v = 0; v < kVectors; ++v) {
          const unsigned at = m + v * W;
          const V re_c = load<V>(task.re[2] + row.c + at), im_c = load<V>(task.im[2] + row.c + at);
          visit(row, at, v, re_ab * re_c - im_ab * im_c, re_ab * im_c + im_ab * re_c);
        }
      end_of_row(row);
    }
  }
  CAROM_INLINE static V counted(double first) {
    V lanes{};
    for (int l = 0; l < W; ++l) lanes[l] = first + l;
    return lanes;
  }
  CAROM_INLINE static V linear(const WaveFactor& f, const WaveRow& row, unsigned at) {
    return (f.constant + row.a * f.a + row.b * f.b) + counted(row.c + static_cast<int>(at)) * f.c;
  }
  /// sin(y)/y for |y| ≤ 1; the first omitted term is below 10^-17.
  CAROM_INLINE static V sinc(V y2) {
    constexpr double kFactor[8] = {1.0 / 272, 1.0 / 210, 1.0 / 156, 1.0 / 110, 1.0 / 72, 1.0 / 42, 1.0 / 20, 1.0 / 6};
    V sum = 1 - y2 * (1.0 / 342);
    for (const double factor : kFactor) sum = 1 - y2 * factor * sum;
    return sum;
  }

  template <class Value>
  CAROM_INLINE static void sum_of(const WaveTask& task, double* sum, Value&& value) {
    V all[kVectors] = {}, along[kVectors] = {}, x[kVectors] = {}, y[kVectors] = {};
    for_each(
        task,
        [&](const WaveRow& row) {
          for (unsigned v = 0; v < kVectors; ++v) {
            x[v] += row.a * all[v];
            y[v] += row.b * all[v];
            all[v] = V{};
          }
        },
        [&](const WaveRow& row, unsigned at, unsigned v, V re, V im) {
          const V g = value(row, at, row.first + at, re, im);
          all[v] += g;
          along[v] += counted(row.c + static_cast<int>(at)) * g;
        });
    const V* const parts[3] = {x, y, along};
    for (int k = 0; k < 3; ++k) {
      double lanes[WaveRow::kMultiple];
      for (std::size_t v = 0; v < kVectors; ++v) store(lanes + v * W, parts[k][v]);
      for (unsigned width = WaveRow::kMultiple / 2; width > 0; width /= 2)
        for (unsigned l = 0; l < width; ++l) lanes[l] += lanes[l + width];
      sum[k] = lanes[0];
    }
  }

  static void add(const WaveTask& task, const WaveFactor& factor, double shift, std::uint64_t* re, std::uint64_t* im) {
    for_each(
        task, [](const WaveRow&) {},
        [&](const WaveRow& row, unsigned at, unsigned, V cos, V sin) {
          const V f = linear(factor, row, at);
          const auto to = [&](std::uint64_t* sum, V value) {
            std::uint64_t* const place = sum + row.first + at;
            store(place, load<BitsOf<V>>(place) + __builtin_bit_cast(BitsOf<V>, value + shift));
          };
          to(re, f * cos);
          to(im, f * sin);
        });
  }
  static void pull(const WaveTask& task, const double* re, const double* im, double* sum) {
    sum_of(task, sum, [&](const WaveRow&, unsigned, unsigned k, V cos, V sin) {
      return load<V>(re + k) * sin - load<V>(im + k) * cos;
    });
  }
  static void pull_moved(const WaveTask& task, const WaveFactor& y, const double* re, const double* im, double* sum) {
    sum_of(task, sum, [&](const WaveRow& row, unsigned at, unsigned k, V cos, V sin) {
      const V angle = linear(y, row, at);
      return (load<V>(re + k) * sin - load<V>(im + k) * cos) * sinc(angle * angle);
    });
  }
  static void pull_change(const WaveTask& task, const WaveFactor& factor, const double* re, const double* im,
                          double* sum) {
    sum_of(task, sum, [&](const WaveRow& row, unsigned at, unsigned k, V cos, V sin) {
      return linear(factor, row, at) * (load<V>(re + k) * cos + load<V>(im + k) * sin);
    });
  }
};

template <int W>
constexpr WaveKernels wave_kernels_of() {
  using Loops = WaveLoops<W>;
  return {Loops::add, Loops::pull, Loops::pull_moved, Loops::pull_change};
}

}  // namespace carom
