// SPDX-License-Identifier: BSD-3-Clause
#include "engine/forces/potentials/wca.h"

#include "engine/forces/potentials/options.h"
#include "engine/forces/potentials/types.h"

namespace carom::types {
namespace {

template <int D>
std::unique_ptr<Interaction<D>> make(const Parameters& p, const InteractionContext<D>& context) {
  const Wca potential(p.real("epsilon"), p.real("sigma"));
  return options::within_reach<D>("wca", potential, PairWeight::one, p, context, potential);
}

}  // namespace

InteractionInfo wca() {
  return {
      .name = "wca",
      .kind = InteractionInfo::Kind::pair,
      .parameters =
          options::with_filter({{"epsilon", Type::real, "", "energy", "V at r = sigma", Range::non_negative},
                                {"sigma", Type::real, "", "length", "distance at which V = eps", Range::positive}}),
      .formula = "sum over pairs of 4 eps [(sigma/r)^12 - (sigma/r)^6] + eps up to r = 2^(1/6) sigma",
      .documentation =
          "The repulsive part of Lennard-Jones. V'' jumps at the cutoff, so no method has an order above 2 with it.",
      .source = "Weeks, Chandler, Andersen, J. Chem. Phys. 54 (1971) 5237",
      .in_2d = make<2>,
      .in_3d = make<3>};
}

}  // namespace carom::types
