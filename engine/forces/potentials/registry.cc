// SPDX-License-Identifier: BSD-3-Clause
// All types of interaction, in the order of the manual, one line each.

#include "engine/forces/potentials/types.h"
#include "engine/laws/interaction.h"

namespace carom {

const std::vector<InteractionInfo>& interactions() {
  static const std::vector<InteractionInfo> all = {
      types::harmonic_bond(),  // springs between bonded pairs
      types::gravity(),        // all pairs
      types::coulomb(),        // all pairs, or damped and cut
      types::yukawa(),         // screened charges
      types::lennard_jones(),  // van der Waals forces
      types::wca(),            // the repulsive part of Lennard-Jones
      types::morse(),          // a well of any width
      types::inverse_power(),  // soft spheres
      types::table(),          // any pair potential, from tabulated points
      types::uniform_field(),  // weight
      types::harmonic_trap(),  // a spring to one point
  };
  return all;
}

const InteractionInfo& find_interaction(std::string_view name) {
  return find_named(interactions(), "interaction", name);
}

}  // namespace carom
