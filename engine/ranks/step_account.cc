// SPDX-License-Identifier: BSD-3-Clause
#include "engine/ranks/step_account.h"

#include "engine/events/step_event.h"
#include "engine/ranks/halo.h"
#include "engine/search/neighbour_list.h"

namespace carom {

template <int D>
StepAccount own_steps(const System<D>& system, const Particles<D>& state) {
  StepAccount own;
  const Box<D>& box = system.box;
  if (box.steps.empty()) return own;
  const GapTolerance tolerance = box.gap_tolerance();
  const auto count = [&](const Particles<D>& p) {
    NeighbourList<D> near(box, box.steps.reach()(p.radius), p.ghost, p.all_fixed());
    for (const auto& [i, j, image] : near.cover(p.x)) {
      const PairSteps* const steps = box.steps.find(p.id_of(i), p.species[i], p.id_of(j), p.species[j]);
      if (!steps) continue;
      const double sigma = p.radius[i] + p.radius[j];
      const std::size_t passed = steps_passed<D>(*steps, {p.x[i] - p.x[j] + box.shift(image), p.v[i] - p.v[j]}, sigma,
                                                 tolerance(sigma), approach_slack(sigma, p.v[i].norm(), p.v[j].norm()));
      if (passed == steps->surfaces.size()) continue;
      ++own.inside;
      if (steps->surfaces.back().tether()) ++own.tethered;
      for (std::size_t k = passed; k < steps->surfaces.size(); ++k)
        if (const StepSurface& each = steps->surfaces[k]; !each.tether()) own.energy.add(-each.climb);
    }
  };
  Decomposition<D>& ranks = const_cast<System<D>&>(system).decomposition;
  if (ranks.joined() && !ranks.by_place())
    count(halo_of(box, 2 * box.steps.reach()(ranks.sizes().largest_radius()), ranks.ranks(), state));
  else
    count(state);
  return own;
}

template StepAccount own_steps(const System<2>&, const Particles<2>&);
template StepAccount own_steps(const System<3>&, const Particles<3>&);

}  // namespace carom
