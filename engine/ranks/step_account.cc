// SPDX-License-Identifier: BSD-3-Clause
#include "engine/ranks/step_account.h"

#include <cmath>

#include "engine/base/error.h"
#include "engine/events/step_event.h"
#include "engine/ranks/halo.h"

namespace carom {

void StepAccount::check(const Steps& steps, double by_events, const std::string& when) const {
  constexpr double kDifference = 1e-6;  // more than the sums round, relative to the smallest jump of an energy
  if (steps.empty()) return;
  if (std::abs(energy.value() - by_events) > kDifference * steps.least_climb())
    throw Error(Failure::numerical,
                "a pair has changed the side of a step unseen " + when + ": the energy of all steps is " +
                    short_text(energy.value(), 12) + " by positions and " + short_text(by_events, 12) +
                    " by events; another sphere has turned the pair within rounding of the step, which is rare: "
                    "continue from the last checkpoint with another integrator.step, or start with another seed");
  if (tethered != steps.tethers())
    throw Error(Failure::numerical, "tethers have lost their pairs (" + std::to_string(steps.tethers() - tethered) +
                                        ") " + when + "; use a smaller integrator.step");
}

template <int D>
StepAccount own_steps(const System<D>& system, const Particles<D>& state, NeighbourList<D>* known) {
  StepAccount own;
  const Box<D>& box = system.box;
  if (box.steps.empty()) return own;
  const double rounding = box.gap_tolerance()(0);
  const bool epoch = box.step == 0;  // free flight
  const auto count = [&](const Particles<D>& p, NeighbourList<D>& near) {
    for (const auto& [i, j, image] : near.cover(p.x)) {
      const PairSteps* const steps = box.steps.find(p.id_of(i), p.species[i], p.id_of(j), p.species[j]);
      if (!steps) continue;
      const double sigma = p.radius[i] + p.radius[j];
      const std::size_t passed = steps_passed<D>(*steps, {p.x[i] - p.x[j] + box.shift(image), p.v[i] - p.v[j]}, sigma,
                                                 side_tolerance(false, epoch, sigma, rounding),
                                                 approach_slack(sigma, p.v[i].norm(), p.v[j].norm()));
      if (passed == steps->surfaces.size()) continue;
      ++own.inside;
      if (steps->surfaces.back().tether()) ++own.tethered;
      for (std::size_t k = passed; k < steps->surfaces.size(); ++k)
        if (const StepSurface& each = steps->surfaces[k]; !each.tether()) own.energy.add(-each.climb);
    }
  };
  const Decomposition<D>& ranks = system.decomposition;
  if (ranks.joined() && !ranks.by_place()) {
    const auto halo = halo_of(box, 2 * box.steps.reach()(ranks.sizes().largest_radius()), ranks.ranks(), state);
    NeighbourList<D> near = pairs_within_reach(system, halo);
    count(halo, near);
  } else if (known) {
    count(state, *known);
  } else {
    NeighbourList<D> near = pairs_within_reach(system, state);
    count(state, near);
  }
  return own;
}

template StepAccount own_steps(const System<2>&, const Particles<2>&, NeighbourList<2>*);
template StepAccount own_steps(const System<3>&, const Particles<3>&, NeighbourList<3>*);

}  // namespace carom
