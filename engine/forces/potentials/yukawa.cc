// SPDX-License-Identifier: BSD-3-Clause
#include "engine/forces/potentials/yukawa.h"

#include "engine/forces/potentials/options.h"
#include "engine/forces/potentials/types.h"

namespace carom::types {
namespace {

template <int D>
std::unique_ptr<Interaction<D>> make(const Parameters& p, const InteractionContext<D>& context) {
  const double contact = options::least_contact<D>("yukawa", p, context);
  const Yukawa potential(p.real("amplitude"), p.real("kappa"), contact);
  return options::pair_term<D>("yukawa", potential, p.flag("charges") ? PairWeight::charges : PairWeight::one, p,
                               context);
}

}  // namespace

InteractionInfo yukawa() {
  return {.name = "yukawa",
          .kind = InteractionInfo::Kind::pair,
          .parameters = options::with_pair_options(
              {{"amplitude", Type::real, "", "energy*length", "A; with charges: energy*length/charge^2"},
               {"kappa", Type::real, "", "1/length", "inverse screening length", Range::non_negative},
               {"charges", Type::boolean, "false", "-", "multiply by both particles' charges"}}),
          .formula = "sum over pairs of A exp(-kappa r)/r, or of A q q' exp(-kappa r)/r",
          .documentation =
              "Screened Coulomb interaction. The hard-core Yukawa fluid of the literature, -eps sigma exp(-lambda (r - "
              "sigma))/r beyond contact, has A = -eps sigma exp(lambda sigma) and kappa = lambda.",
          .source =
              "Yukawa, Proc. Phys.-Math. Soc. Japan 17 (1935) 48; Hansen, McDonald, Theory of Simple Liquids, 4th ed., "
              "ch. 10",
          .in_2d = make<2>,
          .in_3d = make<3>};
}

}  // namespace carom::types
