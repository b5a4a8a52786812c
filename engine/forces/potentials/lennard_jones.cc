// SPDX-License-Identifier: BSD-3-Clause
#include "engine/forces/potentials/lennard_jones.h"

#include "engine/forces/potentials/options.h"
#include "engine/forces/potentials/types.h"

namespace carom::types {
namespace {

template <int D>
std::unique_ptr<Interaction<D>> make(const Parameters& p, const InteractionContext<D>& context) {
  return options::pair_term<D>("lennard-jones", LennardJones(p.real("epsilon"), p.real("sigma")), PairWeight::one, p,
                               context);
}

}  // namespace

InteractionInfo lennard_jones() {
  return {.name = "lennard-jones",
          .kind = InteractionInfo::Kind::pair,
          .parameters = options::with_pair_options(
              {{"epsilon", Type::real, "", "energy", "depth of the well", Range::non_negative},
               {"sigma", Type::real, "", "length", "distance at which V = 0", Range::positive}}),
          .formula = "sum over pairs of 4 eps [(sigma/r)^12 - (sigma/r)^6]",
          .documentation =
              "Van der Waals attraction with a soft core. Literature values for 'cut and shifted' fluids need cut = "
              "'shifted'; those for the full potential, or the truncated one with long-range corrections, tail = true.",
          .source = "Jones, Proc. R. Soc. A 106 (1924) 463",
          .in_2d = make<2>,
          .in_3d = make<3>};
}

}  // namespace carom::types
