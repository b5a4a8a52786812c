// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The concept of a pair potential: four functions of ρ = r², the squared distance.
//
//   value(ρ)              V                              [energy]
//   derivative(ρ)         dV/dρ                          [energy/length²]; the force on i is −2 V′ d, d = x_i − x_j
//   second_derivative(ρ)  d²V/dρ²                        [energy/length⁴]
//   quotient(b, a)        (V(a) − V(b))/(a − b)          [energy/length²], b before, a after; V′ if they coincide
//
// As functions of ρ, many potentials need no square root, and the discrete gradient of a pair is the quotient times d +
// d′ (LaBudde, Greenspan, J. Comput. Phys. 15 (1974) 134). The quotient must be in closed form, never a difference of
// values divided by a small a − b, and symmetric in its arguments bit for bit.
//
// A potential also has, for the rounding of force sums (force_sums.h),
//   scale(distance)       force and energy of a typical pair, or less, at this mean distance of particles
//
// The four functions are templates over T, a double or a vector of doubles (lanes.h), so that the loops over pairs
// evaluate several pairs at once: conditions are written with ?:, never with if, and sqrt, exp, … are those of
// elementary.h. Each potential has a short file of its own; pair_term.h has the loops over pairs.

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

/// A potential with all four functions zero beyond `cutoff_squared()`.
template <class P>
concept ShortRanged = Potential<P> && requires(const P potential) {
  { potential.cutoff_squared() } -> std::same_as<double>;
};

}  // namespace carom
