// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The loops over waves for vectors of W doubles.

#include "engine/base/lanes.h"
#include "engine/forces/simd/wave_kernels.h"

namespace carom {

template <int W>
struct WaveLoops {
  using V = typename Width<W>::Double;
  static constexpr std::size_t kIn = WaveRow::kMultiple;
  static constexpr unsigned kVectors = WaveRow::kMultiple / W;

  /// cos X and sin X of a row.
  struct Flat {
    double cos, sin;
    CAROM_INLINE Flat(const WaveTask& task, const WaveRow& row) {
      const double re_a = task.re[0][row.a], im_a = task.im[0][row.a], re_b = task.re[1][row.b],
                   im_b = task.im[1][row.b];
      cos = re_a * re_b - im_a * im_b;
      sin = re_a * im_b + im_a * re_b;
    }
  };
  /// Calls visit(v, c of the first lane, place of the first product, cos Z, sin Z) for the vectors of a row; v counts
  /// those of a block.
  template <class Visit>
  CAROM_INLINE static void for_each(const WaveTask& task, const WaveRow& row, Visit&& visit) {
    for (unsigned m = 0; m < row.count; m += WaveRow::kMultiple)
      for (unsigned v = 0; v < kVectors; ++v) {
        const unsigned c = m + v * W, at = WaveRow::kProducts * (row.first + m) + v * W;
        visit(v, c, std::size_t{at}, load<V>(task.re[2] + c), load<V>(task.im[2] + c));
      }
  }
  CAROM_INLINE static V counted(unsigned first) {
    V lanes{};
    for (int l = 0; l < W; ++l) lanes[l] = static_cast<double>(first) + l;
    return lanes;
  }
  CAROM_INLINE static void add_bits(std::uint64_t* place, V value, double shift) {
    store(place, load<BitsOf<V>>(place) + __builtin_bit_cast(BitsOf<V>, value + shift));
  }
  /// Adds the lanes of partial sums of three components.
  CAROM_INLINE static void add_lanes(const V (&parts)[3][kVectors], double factor, double* sum) {
    for (int k = 0; k < 3; ++k) {
      double lanes[kIn];
      for (std::size_t v = 0; v < kVectors; ++v) store(lanes + v * W, parts[k][v]);
      for (std::size_t width = kIn / 2; width > 0; width /= 2)
        for (std::size_t l = 0; l < width; ++l) lanes[l] += lanes[l + width];
      sum[k] += factor * lanes[0];
    }
  }

  static void add(const WaveTask& task, double factor, double shift, std::uint64_t* amplitudes) {
    for (std::size_t r = 0; r < task.n; ++r) {
      const Flat flat(task, task.rows[r]);
      const double re = factor * flat.cos, im = factor * flat.sin;
      for_each(task, task.rows[r], [&](unsigned, unsigned, std::size_t at, V cos, V sin) {
        std::uint64_t* const place = amplitudes + at;
        add_bits(place, re * cos, shift);
        add_bits(place + kIn, im * sin, shift);
        add_bits(place + 2 * kIn, re * sin, shift);
        add_bits(place + 3 * kIn, im * cos, shift);
      });
    }
  }
  static void add_change(const WaveTask& task, double factor, const double* w, double shift,
                         std::uint64_t* amplitudes) {
    for (std::size_t r = 0; r < task.n; ++r) {
      const WaveRow& row = task.rows[r];
      const Flat flat(task, row);
      const double angle = row.a * w[0] + row.b * w[1];
      const double re = factor * flat.cos, im = factor * flat.sin, d_re = -angle * im, d_im = angle * re;
      for_each(task, row, [&](unsigned, unsigned c, std::size_t at, V cos, V sin) {
        const V along = counted(c) * w[2], d_cos = -along * sin, d_sin = along * cos;
        std::uint64_t* const place = amplitudes + at;
        add_bits(place, d_re * cos + re * d_cos, shift);
        add_bits(place + kIn, d_im * sin + im * d_sin, shift);
        add_bits(place + 2 * kIn, d_re * sin + re * d_sin, shift);
        add_bits(place + 3 * kIn, d_im * cos + im * d_cos, shift);
      });
    }
  }

  /// Sums of a row: the potential is cos X · of_cos[0] + sin X · of_sin[0]; the others are the first and the negative
  /// second derivative by z.
  template <int kDerivatives>
  struct RowSums {
    V of_cos[kDerivatives + 1][kVectors] = {}, of_sin[kDerivatives + 1][kVectors] = {};
    CAROM_INLINE RowSums(const WaveTask& task, const WaveRow& row, const double* field) {
      for_each(task, row, [&](unsigned v, unsigned c, std::size_t at, V cos, V sin) {
        const V cc = load<V>(field + at), ss = load<V>(field + at + kIn), cs = load<V>(field + at + 2 * kIn),
                sc = load<V>(field + at + 3 * kIn), number = counted(c);
        const V with_cos = cc * cos + cs * sin, with_sin = sc * cos + ss * sin;
        of_cos[0][v] += with_cos;
        of_sin[0][v] += with_sin;
        of_cos[1][v] += number * (cs * cos - cc * sin);
        of_sin[1][v] += number * (ss * cos - sc * sin);
        if constexpr (kDerivatives > 1) {
          of_cos[2][v] += number * number * with_cos;
          of_sin[2][v] += number * number * with_sin;
        }
      });
    }
  };
  static void pull(const WaveTask& task, const double* field, double* sum) {
    V parts[3][kVectors] = {};
    for (std::size_t r = 0; r < task.n; ++r) {
      const WaveRow& row = task.rows[r];
      const Flat flat(task, row);
      const RowSums<1> s(task, row, field);
      for (unsigned v = 0; v < kVectors; ++v) {
        const V across = flat.sin * s.of_cos[0][v] - flat.cos * s.of_sin[0][v];
        parts[0][v] += row.a * across;
        parts[1][v] += row.b * across;
        parts[2][v] -= flat.cos * s.of_cos[1][v] + flat.sin * s.of_sin[1][v];
      }
    }
    add_lanes(parts, 1, sum);
  }
  static void pull_change(const WaveTask& task, const double* w, const double* field, double* sum) {
    V parts[3][kVectors] = {};
    for (std::size_t r = 0; r < task.n; ++r) {
      const WaveRow& row = task.rows[r];
      const Flat flat(task, row);
      const double angle = row.a * w[0] + row.b * w[1], d_cos = -angle * flat.sin, d_sin = angle * flat.cos;
      const RowSums<2> s(task, row, field);
      for (unsigned v = 0; v < kVectors; ++v) {
        const V across = d_sin * s.of_cos[0][v] + flat.sin * (w[2] * s.of_cos[1][v]) - d_cos * s.of_sin[0][v] -
                         flat.cos * (w[2] * s.of_sin[1][v]);
        parts[0][v] += row.a * across;
        parts[1][v] += row.b * across;
        parts[2][v] += flat.cos * (w[2] * s.of_cos[2][v]) + flat.sin * (w[2] * s.of_sin[2][v]) -
                       d_cos * s.of_cos[1][v] - d_sin * s.of_sin[1][v];
      }
    }
    add_lanes(parts, 1, sum);
  }

  /// sin(y)/y by its series up to y^2n.
  template <int n>
  CAROM_INLINE static V sinc(V y2) {
    constexpr double kFactor[9] = {-1.0 / 6,
                                   1.0 / 120,
                                   -1.0 / 5040,
                                   1.0 / 362880,
                                   -1.0 / 39916800,
                                   1.0 / 6227020800,
                                   -1.0 / 1307674368000,
                                   1.0 / 355687428096000,
                                   -1.0 / 121645100408832000};
    V sum = y2 * kFactor[n - 1];
    for (int m = n - 2; m >= 0; --m) sum = (sum + kFactor[m]) * y2;
    return sum + 1.0;
  }
  template <int n>
  CAROM_INLINE static void pull_by_series(const WaveTask& task, const double* y, const double* field, double* sum) {
    V parts[3][kVectors] = {};
    for (std::size_t r = 0; r < task.n; ++r) {
      const WaveRow& row = task.rows[r];
      const Flat flat(task, row);
      const double angle = row.a * y[0] + row.b * y[1];
      V all[kVectors] = {};
      for_each(task, row, [&](unsigned v, unsigned c, std::size_t at, V cos, V sin) {
        const V cc = load<V>(field + at), ss = load<V>(field + at + kIn), cs = load<V>(field + at + 2 * kIn),
                sc = load<V>(field + at + 3 * kIn), number = counted(c), along = number * y[2];
        const V u = flat.cos * cos, w = flat.sin * sin, p = flat.cos * sin, q = flat.sin * cos;
        const V up = angle + along, down = angle - along;
        // The forces of the waves of +c and −c, each twice.
        const V plus = ((cc - ss) * (q + p) - (sc + cs) * (u - w)) * sinc<n>(up * up);
        const V minus = ((cc + ss) * (q - p) - (sc - cs) * (u + w)) * sinc<n>(down * down);
        all[v] += plus + minus;
        parts[2][v] += number * (plus - minus);
      });
      for (unsigned v = 0; v < kVectors; ++v) {
        parts[0][v] += row.a * all[v];
        parts[1][v] += row.b * all[v];
      }
    }
    add_lanes(parts, 0.5, sum);
  }
  // The first omitted terms are 0.25^12/13! and 1/21!, below 10^-17.
  static void pull_moved(const WaveTask& task, const double* y, double most, const double* field, double* sum) {
    if (most <= 0.25)
      pull_by_series<5>(task, y, field, sum);
    else
      pull_by_series<9>(task, y, field, sum);
  }
};

template <int W>
constexpr WaveKernels wave_kernels_of() {
  using Loops = WaveLoops<W>;
  return {Loops::add, Loops::add_change, Loops::pull, Loops::pull_change, Loops::pull_moved};
}

}  // namespace carom
