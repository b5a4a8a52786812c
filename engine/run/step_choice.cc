// SPDX-License-Identifier: BSD-3-Clause
#include "engine/run/step_choice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "engine/base/elementary.h"
#include "engine/forces/forces.h"
#include "engine/ranks/id_blocks.h"
#include "engine/setup/epoch.h"

namespace carom {
namespace {
/// Plan::accuracy if no step is given.
constexpr double kDefaultAccuracy = 1e-4;
/// Plan::step if no particle moves at the start and no step is given, relative to the end of the run. The forces at the
/// start make the first step shorter.
constexpr double kStepAtRest = 1e-3;
}  // namespace

template <int D>
void choose_step(const System<D>& system, const IntegratorInfo& info, const Plan& plan, Parameters& given,
                 double step) {
  if (!info.stepping) return choose_epoch(system, given, step);
  if (!info.adapts || given.has("step")) return;
  if (!given.has("accuracy")) given.set("accuracy", kDefaultAccuracy);
  if (step == 0) {
    Communicator alone;
    const auto& p = system.particles;
    const double distance = mean_distance(system);
    const double fastest = accumulated_in_order(
        system.decomposition.others() ? *system.decomposition.others() : alone, 0.0, [&](double& most) {
          for (Id i = 0; i < p.size(); ++i)
            most = std::max(most, p.v[i].norm() / length_of_error(p.radius[i], distance));
        });
    step = elementary::cbrt(given.real("accuracy")) / fastest;
  }
  if (!std::isfinite(step)) step = plan.end_time ? kStepAtRest * *plan.end_time : 1;
  if (const auto* const longest = given.find<double>("longest_step"); longest && *longest > 0)
    step = std::min(step, *longest);
  given.set("step", step);
}

void set_steps(Plan& plan, const Parameters& parameters) {
  const auto take = [&](const char* name, double& value) {
    if (const auto* const given = parameters.find<double>(name)) value = *given;
  };
  take("step", plan.step);
  take("longest_step", plan.longest_step);
  take("accuracy", plan.accuracy);
  take("shortest_step", plan.shortest_step);
}

// If an acceleration a changes to its own size over a diameter d at the speed v, its rate of change is a v/d, and with
// a h² = 2 d ε^(1/3) and v h = d ε^(1/3) the local error is d ε^(2/3)/6. The first step may be too long, then; it is
// repeated with half of its length until it is not.
template <int D>
double first_step(const System<D>& system, const Plan& plan) {
  const auto& p = system.particles;
  std::vector<Vec<D>> force(p.size());
  Counters uncounted;
  evaluate_forces<D>(system, p.x, force, uncounted);
  const double distance = mean_distance(system);
  double speed = 0, strength = 0, strongest = 0;  // the largest speed and acceleration, in diameters; the latter itself
  for (Id i = 0; i < p.size(); ++i) {
    if (p.fixed(i) || !p.owns(i)) continue;
    const double length = length_of_error(p.radius[i], distance);
    speed = std::max(speed, p.v[i].norm() / length);
    const double acceleration = force[i].norm() / p.mass[i];
    strength = std::max(strength, acceleration / length);
    strongest = std::max(strongest, acceleration);
  }
  std::array<double, 3> most{speed, strength, strongest};
  system.decomposition.ranks().largest(most);
  const double part = elementary::cbrt(plan.accuracy);
  const double length =
      std::min({plan.step, part / most[0], std::sqrt(2 * part / most[1]), longest_step(system, plan, most[2])});
  return std::max(length, plan.shortest_step);
}

// A bath that acts at the ends of steps moves the kinetic energy by at most a tenth of its distance from the mean at
// once. A particle flies no farther than a quarter of the longest edge, as in the slab core, since positions would lose
// digits. It flies no farther than a quarter of the range of each force with a cutoff either: two particles that come
// near feel the force in a step at least before they would have passed each other. Nor would the force on a particle at
// rest move it farther: forces on spheres that hold each other, or balance each other, do not change, but the rounding
// of what they would cause grows with the step. If nothing moves, steps do not grow.
template <int D>
double longest_step(const System<D>& system, const Plan& plan, double strongest) {
  constexpr double kOfRelaxation = 0.1, kOfLength = 0.25;
  double shortest = system.box.edges.maxCoeff();
  for (const auto& term : system.interactions)
    if (const double range = system.decomposition.largest(term->bonds() ? 0 : term->reach(system.particles.x));
        range > 0)
      shortest = std::min(shortest, range);
  double squared = 0;
  for (const Vec<D>& v : system.particles.v) squared = std::max(squared, v.squaredNorm());
  const double fastest = std::sqrt(system.decomposition.largest(squared));
  const Bath& bath = system.box.bath;
  double longest = fastest > 0 ? kOfLength * shortest / fastest : plan.step;
  if (strongest > 0) longest = std::min(longest, std::sqrt(2 * kOfLength * shortest / strongest));
  longest = std::min({longest, system.box.longest_step(),
                      plan.longest_step > 0 ? plan.longest_step : std::numeric_limits<double>::infinity()});
  if (bath.type != Bath::Type::none && bath.relaxation_rate() > 0)
    longest = std::min(longest, kOfRelaxation / bath.relaxation_rate());
  return longest;
}

template void choose_step(const System<2>&, const IntegratorInfo&, const Plan&, Parameters&, double);
template void choose_step(const System<3>&, const IntegratorInfo&, const Plan&, Parameters&, double);
template double first_step(const System<2>&, const Plan&);
template double first_step(const System<3>&, const Plan&);
template double longest_step(const System<2>&, const Plan&, double);
template double longest_step(const System<3>&, const Plan&, double);

}  // namespace carom
