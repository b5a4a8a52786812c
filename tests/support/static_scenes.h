// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Bodies at rest in contact, with their reactions: positions are exact to rounding, so nothing may move.
//
// Radii are 0.5, masses and the weight of a sphere 1 (gravity points down the last axis), unless said otherwise.

#include <memory>
#include <vector>

#include "engine/ranks/system.h"
#include "engine/stepping/rest_criterion.h"

namespace carom::test {

/// The force that keeps two bodies apart in statics.
struct Reaction {
  Id lo, hi;         ///< two spheres; at a wall, the sphere and the number of the wall
  bool wall = true;  ///< whether `hi` is a wall
  double force = 0;
};

/// The reactions that a run with contacts at rest stores for its next step.
template <int D>
std::vector<Reaction> reactions_of(const System<D>& system) {
  std::vector<carom::Reaction<D>> kept;
  for (const auto& entry : system.fields.of_run()) {
    if (entry.name != "reactions") continue;
    Archive taken;
    entry.archive(taken);
    Archive(taken.bytes())(kept);
  }
  std::vector<Reaction> reactions;
  for (const auto& [key, force] : kept) reactions.push_back({key.lo, key.hi, key.kind == EventKind::wall, force});
  return reactions;
}

template <int D>
struct StaticScene {
  std::unique_ptr<System<D>> system;
  /// The reactions of all pressed contacts if equilibrium determines them; otherwise empty.
  std::vector<Reaction> reactions{};
};

/// n discs, each on top of the previous one: a contact carries the weight above it.
StaticScene<2> column(int n);

/// Rows of n, n − 1, … 1 discs, each in the notches of the row below; the lowest fills the box from wall to wall.
StaticScene<2> pyramid(int n);

/// The lowest rows of a pyramid away from the walls, half a hexagon in a trap: n, n − 1, … (n + 1)/2 discs for an odd
/// n.
StaticScene<2> trapped_crystal(int n);

/// n discs of a triangular crystal that fills a box, in rows of 20 and 19 alternately.
StaticScene<2> crystal(int n);

/// An arch: two discs in the corners of the floor, a keystone between and above them, two discs that lean on the
/// keystone and the walls, a keystone on these, and so on, with this number of keystones.
StaticScene<2> arch(int keystones);

/// Layers of n², (n − 1)², … 1 spheres, each in the hollows of the layer below: an fcc pyramid on the floor of a box.
StaticScene<3> heap(int n);

/// The heap of five spheres in a trap away from the walls.
StaticScene<3> trapped_heap();

/// Adds a harmonic trap in the middle of the floor. This changes the reactions, so the scene then lists none.
template <int D>
StaticScene<D> in_trap(StaticScene<D> scene, double stiffness);

/// A chain of four discs on springs that hangs between two columns, whose discs are kept apart and off the walls by
/// struts (compressed springs); a disc rests on the middle of the chain.
StaticScene<2> hanging_chain();

/// A row of touching discs that attract each other.
StaticScene<2> row_under_attraction(int n);

}  // namespace carom::test
