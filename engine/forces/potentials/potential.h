// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// What a pair potential is: four functions of ρ = r², the square of the distance.
//
//   value(ρ)              V                              [energy]
//   derivative(ρ)         dV/dρ                          [energy/length²]; the force on i is −2 V′ d, d = x_i − x_j
//   second_derivative(ρ)  d²V/dρ²                        [energy/length⁴]
//   quotient(b, a)        (V(a) − V(b))/(a − b)          [energy/length²], b before, a after; V′ where they coincide
//
// In ρ no square root is needed where the formula has none, and the discrete gradient of a pair is the quotient times
// d + d′ (LaBudde, Greenspan, J. Comput. Phys. 15 (1974) 134). The quotient is always in closed form: never a
// difference of values divided by a small a − b, and the same bits whichever of the two comes first.
//
// and, for what is rounded in sums of forces (force_sums.h),
//   scale(distance)       the force and energy of a pair that is typical, or less, where particles are so far apart
//
// The four are templates over T, a double or a vector of doubles (lanes.h), so that the loops over pairs work on
// several pairs at once: choices are written with ?:, never with if, and sqrt, exp, … are those of elementary.h. Each
// potential stands in a file of its own, small enough to be read whole; loops over pairs are in pair_term.h.

#include <concepts>

#include "engine/base/elementary.h"
#include "engine/base/force_words.h"

namespace carom {

template <class P>
concept Potential = requires(const P potential, double rho) {
  { potential.value(rho) } -> std::same_as<double>;
  { potential.derivative(rho) } -> std::same_as<double>;
  { potential.second_derivative(rho) } -> std::same_as<double>;
  { potential.quotient(rho, rho) } -> std::same_as<double>;
};

/// A potential that is zero, with all four functions, from `cutoff_squared()` outwards.
template <class P>
concept ShortRanged = Potential<P> && requires(const P potential) {
  { potential.cutoff_squared() } -> std::same_as<double>;
};

}  // namespace carom
