// SPDX-License-Identifier: BSD-3-Clause
#include "io/python/terms.h"

#include "engine/forces/add_interaction.h"
#include "io/deck/deck_source.h"

namespace carom::python {
namespace {

void set_bonds(Force& force, const PairList& bonds) {
  force.parameters.erase("within");
  force.parameters.set("pairs", bonds);
}

}  // namespace

template <int D>
Terms<D>::Terms(const Deck& deck, const System<D>& system) {
  std::size_t found = 0;
  const auto bonds = found_bonds(deck, system);
  for (const InteractionConfig& config : deck.source->interactions) {
    all_.push_back({config.info, config.parameters});
    if (config.parameters.has("within")) set_bonds(all_.back(), bonds[found++]);
  }
}

template <int D>
void Terms<D>::add(const InteractionInfo& info, Parameters complete, System<D>& system) {
  all_.push_back({&info, std::move(complete)});
  try {
    make(system);
  } catch (...) {
    all_.pop_back();
    throw;
  }
}

template <int D>
void Terms<D>::make(System<D>& system) {
  system.interactions.clear();
  system.quanta = {};
  try {
    for (const bool bonded : {true, false})  // bonds first, since other terms may exclude bonded pairs
      for (Force& force : all_) {
        if ((force.info->kind == InteractionInfo::Kind::bonded) != bonded) continue;
        add_interaction(system, *force.info, force.parameters);
        const Interaction<D>& term = *system.interactions.back();
        if (force.parameters.has("within") && term.bonds()) set_bonds(force, *term.bonds());
      }
  } catch (...) {
    system.interactions.clear();
    throw;
  }
}

template class Terms<2>;
template class Terms<3>;

}  // namespace carom::python
