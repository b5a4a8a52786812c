// SPDX-License-Identifier: BSD-3-Clause
#include "engine/ranks/step_account.h"

#include <cmath>

#include "engine/base/error.h"
#include "engine/events/step_event.h"
#include "engine/ranks/close_pairs.h"

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

namespace {

/// Calls visit(lo, hi, surfaces) for the pairs of this rank that are inside of a step. `surfaces`: the ones that the
/// pair is inside of.
template <int D, class Visit>
void visit_pairs_inside(const System<D>& system, const Particles<D>& state, NeighbourList<D>* known, Visit&& visit) {
  const Box<D>& box = system.box;
  const double rounding = box.gap_tolerance()(0);
  const bool epoch = box.step == 0;  // free flight
  visit_close_pairs(system, state, known, [&](const Particles<D>& p, Id i, Id j, const Image<D>& image) {
    const PairSteps* const steps = box.steps.find(p.id_of(i), p.species[i], p.id_of(j), p.species[j]);
    if (!steps) return;
    const double sigma = p.radius[i] + p.radius[j];
    const std::size_t passed = steps_passed<D>(*steps, {p.x[i] - p.x[j] + box.shift(image), p.v[i] - p.v[j]}, sigma,
                                               side_tolerance(false, epoch, sigma, rounding),
                                               approach_slack(sigma, p.v[i].norm(), p.v[j].norm()));
    if (passed == steps->surfaces.size()) return;
    const auto [lo, hi] = std::minmax({p.id_of(i), p.id_of(j)});
    visit(lo, hi, std::span(steps->surfaces).subspan(passed));
  });
}

}  // namespace

template <int D>
StepAccount own_steps(const System<D>& system, const Particles<D>& state, NeighbourList<D>* known) {
  StepAccount own;
  if (system.box.steps.empty()) return own;
  visit_pairs_inside(system, state, known, [&](Id, Id, std::span<const StepSurface> around) {
    ++own.inside;
    if (around.back().tether()) ++own.tethered;
    for (const StepSurface& each : around)
      if (!each.tether()) own.energy.add(-each.climb);
  });
  return own;
}

template <int D>
std::vector<double> step_energies(const System<D>& system, const Particles<D>& state) {
  struct PairEnergy {
    Id lo, hi;
    double energy;
    auto operator<=>(const PairEnergy&) const = default;
  };
  if (system.box.steps.empty()) return {};
  std::vector<PairEnergy> pairs;
  visit_pairs_inside<D>(system, state, nullptr, [&](Id lo, Id hi, std::span<const StepSurface> around) {
    double energy = 0;
    for (const StepSurface& each : around) energy -= each.tether() ? 0 : each.climb;
    pairs.push_back({lo, hi, energy});
  });
  if (Communicator* const ranks = system.decomposition.others()) {
    pairs = gather_values<PairEnergy>(*ranks, pairs);
    if (ranks->rank() > 0) return {};
  }
  std::ranges::sort(pairs);
  std::vector<double> energies(system.size());
  for (const PairEnergy& each : pairs)
    for (const Id i : {each.lo, each.hi}) energies[i] += 0.5 * each.energy;
  return energies;
}

template std::vector<double> step_energies(const System<2>&, const Particles<2>&);
template std::vector<double> step_energies(const System<3>&, const Particles<3>&);

template StepAccount own_steps(const System<2>&, const Particles<2>&, NeighbourList<2>*);
template StepAccount own_steps(const System<3>&, const Particles<3>&, NeighbourList<3>*);

}  // namespace carom
