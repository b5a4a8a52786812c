// SPDX-License-Identifier: BSD-3-Clause
#include "engine/forces/add_interaction.h"

#include "engine/forces/pair_filter.h"

namespace carom {

template <int D>
void add_interaction(System<D>& system, std::string_view type, Parameters given) {
  add_interaction(system, find_interaction(type), std::move(given));
}

template <int D>
void add_interaction(System<D>& system, const InteractionInfo& info, Parameters given) {
  system.interactions.push_back(info.make<D>(completed(info.name, info.parameters, std::move(given)),
                                             {.box = system.box,
                                              .particles = system.particles,
                                              .species = system.species,
                                              .total = system.size(),
                                              .ranks = system.decomposition.others(),
                                              .bonds = bonds_of(system.interactions, system.box.steps)}));
}

template void add_interaction(System<2>&, std::string_view, Parameters);
template void add_interaction(System<3>&, std::string_view, Parameters);
template void add_interaction(System<2>&, const InteractionInfo&, Parameters);
template void add_interaction(System<3>&, const InteractionInfo&, Parameters);

}  // namespace carom
