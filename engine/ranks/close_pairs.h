// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The pairs of a state that are within reach of each other, each on one rank.

#include "engine/ranks/halo.h"
#include "engine/ranks/system.h"
#include "engine/search/neighbour_list.h"
#include "engine/search/sized_cells.h"

namespace carom {

/// Calls visit(particles, i, j, image) for all pairs that may touch or have a step between them; `state` has this
/// rank's particles, and `particles` is `state` or a halo around this rank's part of the box. `known`: a list of these
/// pairs, which is made anew only when necessary, or null: then each call searches. Collective.
template <int D, class Visit>
void visit_close_pairs(const System<D>& system, const Particles<D>& state, NeighbourList<D>* known, Visit&& visit) {
  const Reach reach = system.box.steps.reach();
  const Decomposition<D>& ranks = system.decomposition;
  const auto visit_all = [&](const Particles<D>& p) {
    visit_close_pairs<D>(system.box, p.x, reach(p.radius), p.ghost, p.all_fixed(),
                         [&](Id i, Id j, const Image<D>& image) { visit(p, i, j, image); });
  };
  if (ranks.joined() && !ranks.by_place())
    visit_all(halo_of(system.box, 2 * reach(ranks.sizes().largest_radius()), ranks.ranks(), state));
  else if (known)
    for (const auto& [i, j, image] : known->cover(state.x)) visit(state, i, j, image);
  else
    visit_all(state);
}

}  // namespace carom
