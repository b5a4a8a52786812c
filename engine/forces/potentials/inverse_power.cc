// SPDX-License-Identifier: BSD-3-Clause
#include "engine/forces/potentials/inverse_power.h"

#include "engine/forces/potentials/options.h"
#include "engine/forces/potentials/types.h"

namespace carom::types {
namespace {

template <int D>
std::unique_ptr<Interaction<D>> make(const Parameters& p, const InteractionContext<D>& context) {
  return options::pair_term<D>("inverse-power", InversePower(p.real("epsilon"), p.real("sigma"), p.real("exponent")),
                               PairWeight::one, p, context);
}

}  // namespace

InteractionInfo inverse_power() {
  return {.name = "inverse-power",
          .kind = InteractionInfo::Kind::pair,
          .parameters = options::with_pair_options(
              {{"epsilon", Type::real, "", "energy", "V at r = sigma", Range::any},
               {"sigma", Type::real, "", "length", "length scale", Range::positive},
               {"exponent", Type::real, "", "-", "n, any positive number", Range::positive}}),
          .formula = "sum over pairs of eps (sigma/r)^n",
          .documentation =
              "Soft spheres: n = 12 is the usual choice, n = 36 or more is nearly hard; a negative epsilon attracts.",
          .source = "Hoover et al., J. Chem. Phys. 52 (1970) 4931",
          .in_2d = make<2>,
          .in_3d = make<3>};
}

}  // namespace carom::types
