// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The particles and what acts on them: the state that an integrator advances, with its decomposition among ranks.

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "engine/base/box.h"
#include "engine/base/fields.h"
#include "engine/base/interaction.h"
#include "engine/base/particles.h"
#include "engine/ranks/decomposition.h"

namespace carom {

/// The units in which forces and energies of pairs are rounded: constants of a run, powers of two.
struct Quanta {
  double force = 0;   ///< 2^-44 of the smallest scale of the forces of all terms [force]; 0: not determined
  double energy = 0;  ///< 2^-46 of the smallest scale of their energies [energy]
};

/// Lives on the heap and is never moved: interactions refer to its box and particles, the registry to its arrays.
template <int D>
struct System {
  System() {
    using Kind = Fields::Kind;
    fields.add("position", particles.x);
    fields.add("velocity", particles.v);
    fields.add("image", particles.image);
    fields.add("mass", particles.mass, Kind::constant);
    fields.add("radius", particles.radius, Kind::constant);
    fields.add("charge", particles.charge, Kind::constant);
    fields.add("species", particles.species, Kind::constant);
    fields.add_value("edges", box.edges);
  }
  System(const System&) = delete;
  System& operator=(const System&) = delete;

  Box<D> box;
  Particles<D> particles;                           ///< that this rank works with; one rank: all
  std::vector<std::string> species = {"particle"};  ///< names
  std::vector<std::unique_ptr<Interaction<D>>> interactions;
  Quanta quanta{};  ///< set before the first force pass
  Fields fields;    ///< what belongs to each particle
  Decomposition<D> decomposition{*this};

  /// How many particles there are, on all ranks together, also while they are in the cores.
  std::size_t size() const { return decomposition.total(); }

  /// Whether nothing changes the total momentum: no wall, no field.
  bool keeps_momentum() const {
    return !box.has(Boundary::wall) &&
           std::ranges::all_of(interactions, [](const auto& term) { return term->keeps_momentum(); });
  }

  /// Brings all particles back into the periodic box. Called at slab ends only: a pure function of the records.
  void wrap() {
    for (std::size_t i = 0; i < particles.size(); ++i) box.wrap(particles.x[i], particles.image[i]);
  }

  /// Throws Error(Failure::initial_state) where arrays of the particles differ in length, or a value cannot be:
  /// positions or velocities that are not finite, masses, radii or edges that are not positive, unknown species.
  void check() const;
};

}  // namespace carom
