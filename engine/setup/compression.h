// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Initial states by compression: spheres that fly, collide and grow until they have their sizes (Lubachevsky,
// Stillinger, J. Stat. Phys. 60 (1990) 561; Donev, Torquato, Stillinger, J. Comput. Phys. 202 (2005) 737).
//
// Random insertion ends at a packing fraction of 0.38 (discs: 0.55). From a random insertion of small spheres all radii
// are grown by a common factor s(t), slab after slab on the event core, up to s = 1. Between slabs the velocities are
// scaled back to temperature 1, for growth heats. The relative speed of growth is
//
//   growth_rate · (thermal speed / largest diameter) / Z,
//
// Z = PV/(NkT) the reduced pressure of the last slab, from its collisions: fast in the dilute gas, slow near jamming,
// so that a slab takes the same share of the free volume everywhere (near jamming at a factor s_J, Z ≈ 1/(1 − s/s_J)).
// The slower the growth the denser the spheres jam: equal spheres at packing fractions of 0.64 to 0.66, then as
// crystals.
//
//   const Compression<3> done = compress<3>(box, radius, {.seed = 7});
//   if (done.reached()) use(done.x);     // no overlap
//
// All spheres have mass 1, whatever the masses of the run: the state is a function of box, radii and options only.

#include <span>
#include <vector>

#include "engine/base/box.h"

namespace carom {

struct CompressionOptions {
  std::uint64_t seed = 1;
  double growth_rate = 0.1;     ///< of the largest diameter in a gas, over the thermal speed
  double max_collisions = 1e5;  ///< a particle, before it is given up
};

template <int D>
struct Compression {
  enum class End { reached, no_room, jammed, too_many_collisions };
  End end = End::reached;
  std::vector<Vec<D>> x;        ///< the centres, in the box
  double factor = 0;            ///< of the radii up to which they don't overlap; where the end was reached ≥ 1
  double reduced_pressure = 1;  ///< at the end
  double collisions = 0;        ///< a particle
  bool reached() const { return end == End::reached; }
};

/// Places spheres of these radii in a box without open axes. Ends by `no_room` where a sphere is larger than the box or
/// insertion finds no start, and by `jammed` where the pressure shows that the spheres jam well before their sizes.
template <int D>
Compression<D> compress(const Box<D>& box, std::span<const double> radius, const CompressionOptions& options);

}  // namespace carom
