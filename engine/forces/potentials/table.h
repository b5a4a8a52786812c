// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "engine/forces/potentials/potential.h"

namespace carom {

/// A potential given at points r_0 < r_1 < … < r_n: the C² cubic spline in ρ through them.
///
///   V(ρ) = c0 + x (c1 + x (c2 + x c3)),   x = ρ − r_k² for ρ from r_k² to r_(k+1)²
///   within a piece: (V(a) − V(b))/(a − b) = c1 + c2 (x + y) + c3 (x² + x y + y²)
///   across pieces: the sum of V(end of the first piece) − V(b), V(a) − V(start of the last piece) and the difference
///   between these two knots, over a − b
///
/// At its ends the spline has the given slopes, or zero second derivative (natural). Below r_0 it continues as the
/// parabola with the same slope and second derivative, beyond r_n as the constant V(r_n); the cutoff is at most r_n.
///
/// Errors: a few ε of the largest |c0|, |x c1|, … of the piece; across pieces at most 4 ε (|V(a)| + |V(b)|)/|a − b|.
/// Source: de Boor, A Practical Guide to Splines, 1978, chapter IV.
class Table {
 public:
  /// `r`: ascending and positive, at least two; `values`: V; `slopes`: dV/dr at the first and the last point, or empty.
  Table(std::span<const double> r, std::span<const double> values, std::span<const double> slopes);

  ForceScale scale(double distance) const;

  template <class T>
  T value(T rho) const {
    return evaluate(rho, [](const Piece& p, double x) { return p.c0 + x * (p.c1 + x * (p.c2 + x * p.c3)); });
  }
  template <class T>
  T derivative(T rho) const {
    return evaluate(rho, [](const Piece& p, double x) { return p.c1 + x * (2 * p.c2 + x * (3 * p.c3)); });
  }
  template <class T>
  T second_derivative(T rho) const {
    return evaluate(rho, [](const Piece& p, double x) { return 2 * p.c2 + x * (6 * p.c3); });
  }
  template <class T>
  T quotient(T rho_old, T rho_new) const {
    const T lower = elementary::min(rho_old, rho_new), upper = elementary::max(rho_old, rho_new);
    if constexpr (Lanes<T>) {
      T result = all<T>(0);
      for (int l = 0; l < LanesOf<T>::kCount; ++l) result[l] = ordered_quotient(lower[l], upper[l]);
      return result;
    } else {
      return ordered_quotient(lower, upper);
    }
  }

 private:
  struct Piece {
    double start;  ///< lowest ρ of the piece; the first one extends below the table
    double base;   ///< ρ at x = 0
    double c0, c1, c2, c3;
    [[gnu::always_inline]] double quotient(double x, double y) const {
      return c1 + (c2 * (x + y) + c3 * (x * x + x * y + y * y));
    }
  };

  /// The piece that contains ρ, found from the piece at the start of its cell. Cells are no wider than any piece,
  /// unless there would be too many cells.
  [[gnu::always_inline]] const Piece& piece(double rho) const {
    const double cell = (rho - first_) * inverse_cell_;
    const Piece* p = pieces_ + cells_[static_cast<std::size_t>(cell > 0 ? (cell < last_cell_ ? cell : last_cell_) : 0)];
    while (rho >= p[1].start) ++p;
    while (rho < p->start) --p;
    return *p;
  }

  template <class T, class Formula>
  T evaluate(T rho, Formula&& formula) const {
    if constexpr (Lanes<T>) {
      T result = all<T>(0);
      for (int l = 0; l < LanesOf<T>::kCount; ++l) result[l] = evaluate(double{rho[l]}, formula);
      return result;
    } else {
      const Piece& p = piece(rho);
      return formula(p, rho - p.base);
    }
  }

  [[gnu::always_inline]] double ordered_quotient(double lower, double upper) const {
    const Piece &first = piece(lower), &second = piece(upper);
    const double x = lower - first.base, y = upper - second.base;
    if (&first == &second) return first.quotient(x, y);
    const Piece& next = (&first)[1];
    const double end = next.start - first.base;
    const double rest = (next.start - lower) * first.quotient(x, end), begun = y * second.quotient(0, y);
    return (rest + (second.c0 - next.c0) + begun) / (upper - lower);
  }

  struct Data {
    std::vector<Piece> pieces;  ///< below the table, its pieces, beyond it, and a sentinel that never starts
    std::vector<std::uint32_t> cells;
  };
  std::shared_ptr<const Data> data_;
  const Piece* pieces_;         ///< points into data_; kernels cannot call library functions (lanes.h)
  const std::uint32_t* cells_;  ///< the piece at the start of each cell
  double first_, last_, inverse_cell_, last_cell_;
};

static_assert(Potential<Table>);

}  // namespace carom
