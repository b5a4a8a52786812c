// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The potentials for which kernels are compiled in every vector width; add a line here for a new one.

#include <cstddef>
#include <type_traits>

#include "engine/forces/potentials/cut.h"
#include "engine/forces/potentials/damped_coulomb.h"
#include "engine/forces/potentials/ewald_pair.h"
#include "engine/forces/potentials/harmonic_bond.h"
#include "engine/forces/potentials/inverse_distance.h"
#include "engine/forces/potentials/inverse_power.h"
#include "engine/forces/potentials/lennard_jones.h"
#include "engine/forces/potentials/morse.h"
#include "engine/forces/potentials/table.h"
#include "engine/forces/potentials/wca.h"
#include "engine/forces/potentials/yukawa.h"

namespace carom {

template <class... P>
struct PotentialList {
  static constexpr std::size_t kLength = sizeof...(P);
};

using PairPotentials = PotentialList<HarmonicBond,                     // bonds
                                     InverseDistance,                  // gravity, Coulomb
                                     Cut<DampedCoulomb>,               //
                                     Cut<EwaldPair>,                   //
                                     Yukawa, Cut<Yukawa>,              //
                                     LennardJones, Cut<LennardJones>,  //
                                     Wca,                              //
                                     Morse, Cut<Morse>,                //
                                     InversePower, Cut<InversePower>,  //
                                     Cut<Table>>;

/// The index of a potential in the list, or the list's length if it is not there.
template <class P, class... Listed>
constexpr std::size_t place_of(PotentialList<Listed...>) {
  std::size_t place = 0;
  (void)((std::is_same_v<P, Listed> || (++place, false)) || ...);
  return place;
}

}  // namespace carom
