// SPDX-License-Identifier: BSD-3-Clause
#include "engine/setup/initial_state.h"

#include <algorithm>

#include "engine/ranks/halo.h"
#include "engine/ranks/step_account.h"

namespace carom {

template <int D>
Outsiders find_outsiders(const System<D>& system) {
  const Particles<D>& p = system.particles;
  Outsiders own = find_outsiders<D>(system.box, p.x, p.radius, p.all_fixed()), all;
  if (own.spheres > 0) own.worst = p.id_of(own.worst);
  for (const Outsiders& found : gather_values<Outsiders>(system.decomposition.ranks(), {&own, 1})) {
    const std::size_t spheres = all.spheres + found.spheres;
    if (found.depth > all.depth) all = found;
    all.spheres = spheres;
  }
  return all;
}

template <int D>
Overlaps find_overlaps(const System<D>& system) {
  const Particles<D>& p = system.particles;
  if (!system.decomposition.joined()) return find_overlaps<D>(system.box, p.x, p.radius, {}, p.all_fixed());
  const double diameter = 2 * system.decomposition.sizes().largest_radius();
  const Particles<D> halo = halo_of<D>(system.box, diameter, system.decomposition.ranks(), p);
  Overlaps own = find_overlaps<D>(system.box, halo.x, halo.radius, halo.ghost, halo.all_fixed(), halo.id);
  if (own.pairs > 0) own.lo = halo.id[own.lo], own.hi = halo.id[own.hi];
  return sum_of_all(system.decomposition.ranks(), own);
}

template <int D>
std::string step_problem(const System<D>& system) {
  const Box<D>& box = system.box;
  const Steps& steps = box.steps;
  if (steps.empty()) return "";
  const Particles<D>& p = system.particles;
  std::vector<double> radius(system.species.size(), 0.0);  // the largest one of each species
  for (Id i = 0; i < p.size(); ++i) radius[p.species[i]] = std::max(radius[p.species[i]], p.radius[i]);
  system.decomposition.ranks().largest(radius);
  for (std::size_t a = 0; a < radius.size(); ++a)
    for (std::size_t b = 0; b <= a; ++b)
      if (const PairSteps* const of = steps.of_species(a, b))
        if (const double contact = radius[a] + radius[b];
            of->surfaces.front().distance(contact) < (1 + Steps::kLeastSeparation) * contact)
          return "the step at the distance " + short_text(of->surfaces.front().range) + " between '" +
                 system.species[a] + "' and '" + system.species[b] + "' is not above their contact distance " +
                 short_text(contact) + "; give a larger range";
  double longest = 0;  // bond
  steps.for_each_bond([&](Id, Id, const PairSteps& of) {
    longest = std::max(longest, of.farthest(2 * *std::ranges::max_element(radius)));
  });
  const double farthest = 2 * steps.reach()(*std::ranges::max_element(radius));
  for (int k = 0; k < D; ++k)
    if (box.periodic(k) && box.edges[k] < std::max(farthest, 2 * longest))
      return "the periodic box is " + short_text(box.edges[k]) + " long on axis " + std::to_string(k) +
             ", and steps act up to a distance of " + short_text(farthest) + ", bonds up to " + short_text(longest) +
             "; enlarge the box to the distance of steps and to twice that of bonds, which span the nearest image";
  std::string problem;
  if (!system.decomposition.joined())
    steps.for_each_bond([&](Id i, Id j, const PairSteps& of) {
      const Vec<D> d = p.x[i] - p.x[j];
      const double distance = (d + box.shift(box.nearest_image(d))).norm(), contact = p.radius[i] + p.radius[j];
      const double core = of.core_distance(contact),
                   inmost = of.surfaces.empty() ? 2 * core : of.surfaces[0].distance(contact);
      const std::string pair = "particles " + std::to_string(i) + " and " + std::to_string(j);
      if (inmost < (1 + Steps::kLeastSeparation) * core)
        problem = pair + " have a step at the distance " + short_text(inmost) + ", not above their contact distance " +
                  short_text(core) + "; give a larger one, or a smaller 'core'";
      else if (p.fixed(i) && p.fixed(j))
        problem = pair + " are fixed and cannot be bonded; leave the pair out";
      else if (distance < core - box.gap_tolerance()(core))
        problem = pair + " start at a distance of " + short_text(distance, 10) + ", and their core is " +
                  short_text(core) + " wide; move them apart, or give a smaller core";
      else if (!of.surfaces.empty() && of.surfaces.back().tether() &&
               distance > of.surfaces.back().range + box.gap_tolerance()(contact))
        problem = pair + " start at a distance of " + short_text(distance, 10) + ", and their tether is " +
                  short_text(of.surfaces.back().range) + " long; move them together, or give a longer tether";
    });
  if (!problem.empty()) return problem;
  if (const std::uint64_t found = system.decomposition.sum(own_steps(system, p)).tethered; found != steps.tethers())
    return "bonded pairs (" + std::to_string(steps.tethers() - found) +
           ") start farther apart than their tether; move them together, or give a longer tether";
  return "";
}

template std::string step_problem(const System<2>&);
template std::string step_problem(const System<3>&);
template Overlaps find_overlaps(const System<2>&);
template Overlaps find_overlaps(const System<3>&);
template Outsiders find_outsiders(const System<2>&);
template Outsiders find_outsiders(const System<3>&);

}  // namespace carom
