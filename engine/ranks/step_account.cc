// SPDX-License-Identifier: BSD-3-Clause
#include "engine/ranks/step_account.h"

#include "engine/events/step_event.h"
#include "engine/ranks/halo.h"

namespace carom {

template <int D>
StepAccount own_steps(const System<D>& system, const Particles<D>& state, NeighbourList<D>* known) {
  StepAccount own;
  const Box<D>& box = system.box;
  if (box.steps.empty()) return own;
  const auto count = [&](const Particles<D>& p, NeighbourList<D>& near) {
    for (const auto& [i, j, image] : near.cover(p.x)) {
      const PairSteps* const steps = box.steps.find(p.id_of(i), p.species[i], p.id_of(j), p.species[j]);
      if (!steps) continue;
      const double sigma = p.radius[i] + p.radius[j];
      const std::size_t passed =
          steps_passed<D>(*steps, {p.x[i] - p.x[j] + box.shift(image), p.v[i] - p.v[j]}, sigma,
                          side_tolerance(box, false, true, sigma), approach_slack(sigma, p.v[i].norm(), p.v[j].norm()));
      if (passed == steps->surfaces.size()) continue;
      ++own.inside;
      if (steps->surfaces.back().tether()) ++own.tethered;
      for (std::size_t k = passed; k < steps->surfaces.size(); ++k)
        if (const StepSurface& each = steps->surfaces[k]; !each.tether()) own.energy.add(-each.climb);
    }
  };
  Decomposition<D>& ranks = const_cast<System<D>&>(system).decomposition;
  if (ranks.joined() && !ranks.by_place()) {
    const auto halo = halo_of(box, 2 * box.steps.reach()(ranks.sizes().largest_radius()), ranks.ranks(), state);
    NeighbourList<D> near = step_pairs(system, halo);
    count(halo, near);
  } else if (known) {
    count(state, *known);
  } else {
    NeighbourList<D> near = step_pairs(system, state);
    count(state, near);
  }
  return own;
}

template StepAccount own_steps(const System<2>&, const Particles<2>&, NeighbourList<2>*);
template StepAccount own_steps(const System<3>&, const Particles<3>&, NeighbourList<3>*);

}  // namespace carom
