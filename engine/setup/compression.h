// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Initial states by compression: spheres move, collide and grow to their final sizes (Lubachevsky, Stillinger, J. Stat.
// Phys. 60 (1990) 561; Donev, Torquato, Stillinger, J. Comput. Phys. 202 (2005) 737).
//
// Random insertion reaches at most a packing fraction of 0.38 (discs: 0.55). Compression starts from a random insertion
// of small spheres and lets all radii grow by a common factor s(t), slab after slab on the event core, up to s = 1.
// Growth heats the spheres, so velocities are scaled back to temperature 1 between slabs. The relative growth rate is
//
//   growth_rate · (thermal speed / largest diameter) / Z,
//
// where Z = PV/(NkT) is the reduced pressure of the last slab, from its collisions. Growth is fast in the dilute gas
// and slow near jamming, so a slab always uses the same fraction of the free volume (near jamming at a factor s_J, Z ≈
// 1/(1 − s/s_J)). Slower growth gives denser jammed states: equal spheres reach packing fractions of 0.64 to 0.66, and
// still slower ones crystallise.
//
//   const Compression<3> done = compress<3>(box, radius, {.seed = 7});
//   if (done.reached()) use(done.x);     // no overlap
//
// All spheres have mass 1, whatever the masses of the run: the state depends only on box, radii and options.

#include <span>
#include <vector>

#include "engine/laws/box.h"
#include "engine/setup/placement.h"

namespace carom {

struct CompressionOptions {
  std::uint64_t seed = 1;
  double growth_rate = 0.1;     ///< growth rate of the largest diameter in a gas, over the thermal speed
  double max_collisions = 1e5;  ///< a particle, after which compression gives up
  Pause pause{};                ///< may end the compression
};

template <int D>
struct Compression {
  enum class End { reached, no_room, jammed, too_many_collisions };
  End end = End::reached;
  std::vector<Vec<D>> x;        ///< centres, in the box
  double factor = 0;            ///< factor of the radii without overlap; ≥ 1 if reached
  double reduced_pressure = 1;  ///< Z of the last slab
  double collisions = 0;        ///< a particle
  bool reached() const { return end == End::reached; }
};

/// Places spheres of these radii in a box without open axes. Ends with `no_room` if a sphere is larger than the box or
/// random insertion fails, with `jammed` if the pressure shows that the spheres jam well below their sizes.
template <int D>
Compression<D> compress(const Box<D>& box, std::span<const double> radius, const CompressionOptions& options);

}  // namespace carom
