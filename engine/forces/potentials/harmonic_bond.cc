// SPDX-License-Identifier: BSD-3-Clause
#include "engine/forces/potentials/harmonic_bond.h"

#include "engine/forces/potentials/options.h"
#include "engine/forces/potentials/types.h"

namespace carom::types {
namespace {

template <int D>
std::unique_ptr<Interaction<D>> make(const Parameters& p, const InteractionContext<D>& context) {
  Bonds<D> bonds(context.box, options::bonds<D>("harmonic-bond", p, context));
  const HarmonicBond spring(p.real("stiffness"), p.real("rest_length"));
  return options::term<D>(spring, PairWeight::one, context, std::move(bonds), spring);
}

}  // namespace

InteractionInfo harmonic_bond() {
  return {
      .name = "harmonic-bond",
      .kind = InteractionInfo::Kind::bonded,
      .parameters = {{"pairs", Type::pair_list, "none", "-", "the bonded pairs of particles, by number from 0"},
                     {"chain", Type::boolean, "false", "-", "bond each particle to the next, instead of giving pairs"},
                     {"chain_length", Type::integer, "none", "-",
                      "particles in each chain, in id order; absent: a single chain of all", Range::positive},
                     {"within", Type::real, "none", "length",
                      "bond the pairs that stand no farther apart than this at the start, instead of giving pairs",
                      Range::positive},
                     {"stiffness", Type::real, "", "energy/length^2", "k", Range::non_negative},
                     {"rest_length", Type::real, "", "length", "L, where the spring is slack", Range::non_negative}},
      .formula = "sum over bonds of k/2 (r - L)^2",
      .documentation =
          "Springs between given pairs of particles. In a periodic box a bond spans the nearest image, so it must stay "
          "shorter than half an edge.",
      .source = "the springs of Enomoto, thesis, 2011, experiment 1",
      .in_2d = make<2>,
      .in_3d = make<3>};
}

}  // namespace carom::types
