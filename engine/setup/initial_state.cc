// SPDX-License-Identifier: BSD-3-Clause
#include "engine/setup/initial_state.h"

#include "engine/ranks/halo.h"

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
  Overlaps own = find_overlaps<D>(system.box, halo.x, halo.radius, halo.ghost, halo.all_fixed());
  if (own.pairs > 0) own.lo = halo.id[own.lo], own.hi = halo.id[own.hi];
  return sum_of_all(system.decomposition.ranks(), own);
}

template Overlaps find_overlaps(const System<2>&);
template Overlaps find_overlaps(const System<3>&);
template Outsiders find_outsiders(const System<2>&);
template Outsiders find_outsiders(const System<3>&);

}  // namespace carom
