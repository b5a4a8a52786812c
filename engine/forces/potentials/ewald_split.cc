// SPDX-License-Identifier: BSD-3-Clause
// Estimates of the errors of Ewald sums, from which the parameters follow.

#include <cmath>
#include <numbers>

#include "engine/base/elementary.h"
#include "engine/forces/potentials/ewald.h"

namespace carom {
namespace {

constexpr double kPi = std::numbers::pi;
// From here to the cutoff the switching function takes the pair term to zero; the force error that it causes is about
// that of ending the pair term here.
constexpr double kSwitchFrom = 0.95;  // of the cutoff
// α = √π (c N/Ω²)^(1/6) makes pairs and waves cost the same, c the cost of a pair over that of a wave of a particle
// (Kolafa, Perram); c is taken as 6, the sixth power of:
constexpr double kPairCost = 1.35;
// The most partners of a charge within the cutoff. From 340,000 charges at an accuracy of 1e-4, or 31,000 at 1e-9, more
// would be cheaper than waves, but their list, of four bytes a pair within 1.1 cutoffs, would outgrow memory (and the
// limit of pair_list.cc) before anything else does.
constexpr double kMostPartners = 6000;
// The part of the error of the pair sum that the polynomial of its formula (ewald_pair.h) may cause.
constexpr double kPolynomial = 0.05;

}  // namespace

EwaldSplit ewald_split(double accuracy, const ChargeSums& charges, double volume, double repeated, double longest) {
  const double n = charges.count.value(), q2 = charges.squares.value();
  const double spacing = elementary::cbrt(volume / n);
  const double error = 0.5 * accuracy * q2 / n / (spacing * spacing);  // of either sum
  longest = std::min(longest, spacing * elementary::cbrt(3 * kMostPartners / (4 * kPi)));
  const auto root_log = [](double x) { return std::sqrt(std::max(1.0, elementary::log(x))); };
  double alpha = kPairCost * std::sqrt(kPi) * elementary::pow(n / (volume * repeated), 1.0 / 6);
  const auto pairs = [&](double r) { return root_log(2 * q2 / (std::sqrt(n * r * volume) * error)); };
  double end = 3 / alpha;  // where the pair sum is cut off
  for (int turn = 0; turn < 20; ++turn) end = pairs(end) / alpha;
  if (end > kSwitchFrom * longest) {
    end = kSwitchFrom * longest;
    alpha = pairs(end) / end;
  }
  double t = 3;  // k_c/2α
  for (int turn = 0; turn < 20; ++turn) {
    t = root_log(q2 * alpha * std::sqrt(8 / (n * repeated * 2 * alpha * t)) / error);
  }
  // The force between two charges is 2 C q² r α³ dE/du, and the errors of the partners of a charge are independent.
  const double r = end / kSwitchFrom, near = std::max(1.0, 4 * kPi / 3 * elementary::pow(r / spacing, 3));
  const double pair_error =
      kPolynomial * 0.5 * accuracy / (spacing * spacing * std::sqrt(near) * 2 * r * elementary::pow(alpha, 3));
  return {alpha, end, r, 2 * alpha * t, pair_error};
}

double slab_gap(double accuracy, double n, double volume, double area, double longer) {
  const double spacing = elementary::cbrt(volume / n);
  const double ratio = 32 * kPi * std::sqrt(n) * spacing * spacing / (area * accuracy);
  return longer / (2 * kPi) * std::max(1.0, elementary::log(ratio));
}

}  // namespace carom
