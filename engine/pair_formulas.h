// Kernels that turn separations into forces, one for each potential, and the table of all kernels; included, as
// pair_kernel.h, by pair_kernels_*.cc only.

#include <type_traits>

#include "engine/pair_kernel.h"
#include "engine/potentials/pair_potentials.h"

namespace carom {
namespace {

/// x as integers, |x| < 2^51: to nearest, the even one of two.
template <class V>
CAROM_INLINE IntegerOf<V> integers(V x) {
  return (IntegerOf<V>)(x + 0x1.8p52) - (IntegerOf<V>)all<V>(0x1.8p52);
}

enum class Wanted { forces, forces_and_sums, mean_forces, hessian_product };

template <int W, class P, Wanted wanted, bool wide>
[[gnu::flatten]] bool evaluate(const void* any_potential, PairBatch& batch, const PairUnits& units,
                               PairTotals* totals) {
  using V = typename Width<W>::Double;
  using I = IntegerOf<V>;
  // A copy lets the compiler keep constants in registers; what owns memory is not to be copied here.
  std::conditional_t<std::is_trivially_copyable_v<P>, const P, const P&> potential =
      *static_cast<const P*>(any_potential);
  constexpr int kWords = wide ? 2 : 1;
  I sum[3][kWords] = {};  // energy, magnitude, virial
  I fits = ~I{};
  const double limit = wide ? units.limits.high : units.limits.low;
  const double per_virial = 0x1p-6 * units.per_energy / units.per_force;  // virials are counted in 64 quanta
  for (unsigned k = 0; k < batch.n; k += W) {
    V d[3];
    for (int axis = 0; axis < 3; ++axis) d[axis] = load<V>(batch.d[axis] + k);
    const V rho = d[0] * d[0] + d[1] * d[1] + d[2] * d[2], weight = load<V>(batch.weight + k);
    V g, e[3];  // force = g d
    if constexpr (wanted == Wanted::mean_forces || wanted == Wanted::hessian_product)
      for (int axis = 0; axis < 3; ++axis) e[axis] = load<V>(batch.d_new[axis] + k);
    if constexpr (wanted == Wanted::mean_forces) {
      g = -weight * potential.quotient(rho, e[0] * e[0] + e[1] * e[1] + e[2] * e[2]);
      for (int axis = 0; axis < 3; ++axis) d[axis] += e[axis];
    } else {
      g = -2.0 * weight * potential.derivative(rho);
      if constexpr (wanted == Wanted::hessian_product) {
        const V along = 4.0 * weight * potential.second_derivative(rho) * (d[0] * e[0] + d[1] * e[1] + d[2] * e[2]);
        for (int axis = 0; axis < 3; ++axis) d[axis] = along * d[axis] - g * e[axis];
        g = all<V>(1);
      }
    }
    g *= units.per_force;  // a power of two: the same as of the product
    V largest = all<V>(0);
    for (int axis = 0; axis < 3; ++axis) {
      const V force = g * d[axis];
      if constexpr (wide) {
        const V upper = elementary::nearest_integer(force * 0x1p-40);
        largest += elementary::abs(upper);
        store(batch.high[axis] + k, integers(upper));
        store(batch.low[axis] + k, integers(force - upper * 0x1p40));
      } else {
        largest += elementary::abs(force);
        store(batch.low[axis] + k, integers(force));
      }
    }
    fits &= (I)(largest < limit);  // not where one is no number
    if constexpr (wanted == Wanted::forces_and_sums) {
      const V energy = weight * potential.value(rho) * units.per_energy, virial = g * rho * per_virial;
      const V magnitude = elementary::abs(energy), terms[3] = {energy, magnitude, virial};
      fits &= (I)(magnitude + elementary::abs(virial) < (wide ? 0x1p90 : 0x1p50));
      for (int s = 0; s < 3; ++s) {
        if constexpr (wide) {
          const V upper = elementary::nearest_integer(terms[s] * 0x1p-40);
          sum[s][1] += integers(upper);
          sum[s][0] += integers(terms[s] - upper * 0x1p40);
        } else {
          sum[s][0] += integers(terms[s]);
        }
      }
    }
  }
  if (bits(fits) != (1u << W) - 1) return false;
  if constexpr (wanted == Wanted::forces_and_sums) {
    PairTotals::Whole whole[3] = {0, 0, 0};
    for (int s = 0; s < 3; ++s)
      for (int l = 0; l < W; ++l) {
        whole[s] += sum[s][0][l];
        if constexpr (wide) whole[s] += static_cast<PairTotals::Whole>(sum[s][1][l]) << 40;
      }
    totals->energy += whole[0];
    totals->magnitude += whole[1];
    totals->virial += whole[2];
  }
  return true;
}

template <int W, class P>
constexpr PairFormula formula() {
  using enum Wanted;
  return {{evaluate<W, P, forces, false>, evaluate<W, P, forces, true>},
          {evaluate<W, P, forces_and_sums, false>, evaluate<W, P, forces_and_sums, true>},
          {evaluate<W, P, mean_forces, false>, evaluate<W, P, mean_forces, true>},
          {evaluate<W, P, hessian_product, false>, evaluate<W, P, hessian_product, true>}};
}

template <int W, class... P>
struct Formulas {
  static constexpr PairFormula kAll[] = {formula<W, P>()...};
};

template <int W, class... P>
constexpr PairKernels kernels_of(const char* name, PotentialList<P...>) {
  return {name, collect<W>, scatter<W>, find_partners<W>, Formulas<W, P...>::kAll};
}

}  // namespace
}  // namespace carom
