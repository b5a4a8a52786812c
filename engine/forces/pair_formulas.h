// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Forces from separations: the loop over a batch of pairs for one potential, written once for any number of lanes.
//
// The kernels instantiate it for the potentials of pair_potentials.h in every vector width; for other potentials it is
// compiled where they are used (pair_term.h). Linkage is internal, so that the linker cannot use a function compiled
// for another instruction set.

#include <type_traits>

#include "engine/base/lanes.h"
#include "engine/forces/simd/pair_kernels.h"

namespace carom {
namespace {

/// The bits of x + kToInteger minus the bits of kToInteger are the integer x, |x| < 2^51.
constexpr double kToInteger = 0x1.8p52;
template <class V>
CAROM_INLINE IntegerOf<V> integers(V x) {
  return (IntegerOf<V>)((BitsOf<V>)(x + kToInteger) - (BitsOf<V>)all<V>(kToInteger));
}

enum class Wanted { forces, forces_and_sums, mean_forces, hessian_product };

template <int W, class P, Wanted wanted, bool wide>
[[gnu::flatten]] bool evaluate(const void* any_potential, PairBatch& batch, const PairUnits& units,
                               PairTotals* totals) {
  using V = typename Width<W>::Double;
  using I = IntegerOf<V>;
  // A copy lets the compiler keep constants in registers; potentials that own memory are not copied.
  std::conditional_t<std::is_trivially_copyable_v<P>, const P, const P&> potential =
      *static_cast<const P*>(any_potential);
  constexpr int kWords = wide ? 2 : 1;
  using U = BitsOf<V>;
  U sum[3][kWords] = {};  // energy, magnitude, virial; modulo 2^64
  I fits = ~I{};
  constexpr double kFactor = wanted == Wanted::mean_forces ? -1 : wanted == Wanted::hessian_product ? 1 : -2;
  const double limit = wide ? units.limits.high * 0x1p40 : units.limits.low;
  const double per_virial = 0x1p-6 * units.per_energy / units.per_force;  // virials are in units of 64 quanta
  for (unsigned k = 0; k < batch.n; k += W) {
    V d[3], force[3], e[3], squared;
    for (int axis = 0; axis < 3; ++axis) d[axis] = load<V>(batch.d[axis] + k);
    const V rho = d[0] * d[0] + d[1] * d[1] + d[2] * d[2], weight = load<V>(batch.weight + k);
    const V w = weight * (kFactor * units.per_force);  // scaling by a power of two commutes with rounding
    if constexpr (wanted == Wanted::mean_forces || wanted == Wanted::hessian_product) {
      for (int axis = 0; axis < 3; ++axis) e[axis] = load<V>(batch.d_new[axis] + k);
      if constexpr (wanted == Wanted::mean_forces) {
        const V g = w * potential.quotient(rho, e[0] * e[0] + e[1] * e[1] + e[2] * e[2]);
        for (int axis = 0; axis < 3; ++axis) force[axis] = g * (d[axis] + e[axis]);
      } else {
        const V along = 4.0 * w * potential.second_derivative(rho) * (d[0] * e[0] + d[1] * e[1] + d[2] * e[2]);
        const V across = 2.0 * w * potential.derivative(rho);
        for (int axis = 0; axis < 3; ++axis) force[axis] = along * d[axis] + across * e[axis];
      }
      squared = force[0] * force[0] + force[1] * force[1] + force[2] * force[2];
    } else {
      const V g = w * potential.derivative(rho), along = g * rho;
      for (int axis = 0; axis < 3; ++axis) force[axis] = g * d[axis];
      squared = g * along;
      if constexpr (wanted == Wanted::forces_and_sums) {
        const V energy = weight * units.per_energy * potential.value(rho), virial = along * per_virial;
        const V magnitude = elementary::abs(energy), terms[3] = {energy, magnitude, virial};
        fits &= below(magnitude + elementary::abs(virial), all<V>(wide ? 0x1p90 : 0x1p50));
        for (int s = 0; s < 3; ++s) {
          const V upper = wide ? elementary::nearest_integer(terms[s] * 0x1p-40) : V{};
          sum[s][0] += (U)((wide ? terms[s] - upper * 0x1p40 : terms[s]) + kToInteger);
          if constexpr (wide) sum[s][1] += (U)integers(upper);
        }
      }
    }
    fits &= below(squared, all<V>(limit * limit));  // false also for NaN
    for (int axis = 0; axis < 3; ++axis) {
      if constexpr (wide) {
        const V upper = elementary::nearest_integer(force[axis] * 0x1p-40);
        store(batch.high[axis] + k, integers(upper));
        force[axis] -= upper * 0x1p40;
      }
      store(batch.low[axis] + k, integers(force[axis]));
    }
  }
  if (bits(fits) != (1u << W) - 1) return false;
  if constexpr (wanted == Wanted::forces_and_sums) {
    PairTotals::Whole* const totals_of[3] = {&totals->energy, &totals->magnitude, &totals->virial};
    for (int s = 0; s < 3; ++s) {
      std::uint64_t low = 0;
      for (int l = 0; l < W; ++l) {
        low += sum[s][0][l];
        if constexpr (wide) *totals_of[s] += PairTotals::Whole{static_cast<std::int64_t>(sum[s][1][l])} << 40;
      }
      low -= (std::uint64_t{batch.n} + W - 1) / W * W * __builtin_bit_cast(std::uint64_t, kToInteger);
      *totals_of[s] += static_cast<std::int64_t>(low);
    }
  }
  return true;
}

template <int W, class P>
constexpr PairFormula pair_formula() {
  using enum Wanted;
  return {{evaluate<W, P, forces, false>, evaluate<W, P, forces, true>},
          {evaluate<W, P, forces_and_sums, false>, evaluate<W, P, forces_and_sums, true>},
          {evaluate<W, P, mean_forces, false>, evaluate<W, P, mean_forces, true>},
          {evaluate<W, P, hessian_product, false>, evaluate<W, P, hessian_product, true>}};
}

}  // namespace
}  // namespace carom
