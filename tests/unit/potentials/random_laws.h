// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Random pair potentials over many orders of magnitude, from independent formulas in long double.

#include <cmath>
#include <functional>
#include <random>

#include "tests/support/experiments.h"

namespace carom::test {

using Real = long double;

/// A number with the sum of the magnitudes of its terms, scaled by the ratio of their own allowed rounding to ε: errors
/// are relative to this.
struct Sized {
  Real v, size;
  Sized(Real value) : v(value), size(std::abs(value)) {}
  Sized(Real value, Real magnitude) : v(value), size(magnitude) {}
  friend Sized operator+(Sized a, Sized b) { return {a.v + b.v, a.size + b.size}; }
  friend Sized operator-(Sized a, Sized b) { return {a.v - b.v, a.size + b.size}; }
  friend Sized operator*(Sized a, Sized b) { return {a.v * b.v, a.size * b.size}; }
  friend Sized operator/(Sized a, Real b) { return {a.v / b, a.size / std::abs(b)}; }
};

using Function = std::function<Sized(Real)>;  // of ρ

struct Dice {
  std::mt19937_64 random;
  double uniform(double from, double to) { return std::uniform_real_distribution<double>(from, to)(random); }
  double decades(double from, double to) { return std::pow(10, uniform(from, to)); }
  std::size_t below(std::size_t n) { return random() % n; }
  bool one_in(std::size_t n) { return below(n) == 0; }
};

/// One term of V.
struct Law {
  std::string type;
  Given given = {};
  Function value = {}, slope = {};  // V and dV/dρ
  std::vector<double> breaks = {};  // discontinuities of higher derivatives, ascending [ρ]
  double cutoff2 = std::numeric_limits<double>::infinity();
  enum { one, masses, charges } weight = one;
  PairList bonds = {};

  /// The divided difference; for a short step the mean of the slope, by three Gauss points in each smooth part.
  Sized quotient(Real a, Real b) const;
  /// Cuts the potential off.
  void cut(double cutoff, const std::string& kind, Real curvature = 0);
};

/// For this number of particles in a box of this edge.
Law random_law(Dice& dice, std::size_t particles, double edge, bool periodic);

}  // namespace carom::test
