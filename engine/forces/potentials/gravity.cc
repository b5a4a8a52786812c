// SPDX-License-Identifier: BSD-3-Clause
#include "engine/forces/potentials/inverse_distance.h"
#include "engine/forces/potentials/options.h"
#include "engine/forces/potentials/types.h"

namespace carom::types {
namespace {

template <int D>
std::unique_ptr<Interaction<D>> make(const Parameters& p, const InteractionContext<D>& context) {
  double fixed = context.particles.any_fixed() ? 1 : 0;
  if (context.ranks) context.ranks->largest({&fixed, 1});
  if (fixed > 0)
    options::refuse("gravity",
                    "the infinite mass of a fixed particle would attract without limit; give it a large finite mass");
  return options::all_pairs<D>("gravity", InverseDistance(-p.real("constant")), PairWeight::masses, p, context,
                               "make the boundaries 'wall' or 'open'");
}

}  // namespace

InteractionInfo gravity() {
  return {.name = "gravity",
          .kind = InteractionInfo::Kind::pair,
          .parameters = options::with_filter({{"constant", Type::real, "1.0", "energy*length/mass^2", "G"}}),
          .formula = "sum over pairs of -G m m'/r",
          .documentation = "Newton's gravitation; all pairs are summed directly. Not in periodic boxes.",
          .source = "Enomoto, thesis, 2011, experiment 2",
          .in_2d = make<2>,
          .in_3d = make<3>};
}

}  // namespace carom::types
