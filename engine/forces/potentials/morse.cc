// SPDX-License-Identifier: BSD-3-Clause
#include "engine/forces/potentials/morse.h"

#include "engine/forces/potentials/options.h"
#include "engine/forces/potentials/types.h"

namespace carom::types {
namespace {

template <int D>
std::unique_ptr<Interaction<D>> make(const Parameters& p, const InteractionContext<D>& context) {
  return options::pair_term<D>("morse", Morse(p.real("depth"), p.real("alpha"), p.real("r0")), PairWeight::one, p,
                               context);
}

}  // namespace

InteractionInfo morse() {
  return {.name = "morse",
          .kind = InteractionInfo::Kind::pair,
          .parameters = options::with_pair_options(
              {{"depth", Type::real, "", "energy", "D, of the well; D0 in LAMMPS and HOOMD", Range::non_negative},
               {"alpha", Type::real, "", "1/length", "inverse width of the well", Range::positive},
               {"r0", Type::real, "", "length", "distance at which V is least", Range::non_negative}}),
          .formula = "sum over pairs of D [(1 - exp(-alpha (r - r0)))^2 - 1]",
          .documentation =
              "Bonds that can break, metals, colloids with a short-ranged attraction. alpha r0 = 6 gives the width of "
              "the Lennard-Jones well, 14 and more that of sticky spheres. V is finite at r = 0: cores that must not "
              "be penetrated need an alpha r0 well above 1.",
          .source = "Morse, Phys. Rev. 34 (1929) 57",
          .in_2d = make<2>,
          .in_3d = make<3>};
}

}  // namespace carom::types
