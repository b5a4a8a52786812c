// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The state that an integrator advances: particles, interactions, and the decomposition among ranks.

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "engine/base/elementary.h"
#include "engine/base/fields.h"
#include "engine/base/particles.h"
#include "engine/laws/box.h"
#include "engine/laws/interaction.h"
#include "engine/ranks/decomposition.h"

namespace carom {

/// The units to which pair forces and energies are rounded: powers of two, constant in a run.
struct Quanta {
  double force = 0;   ///< 2^-44 of the smallest scale of the forces of all terms [force]; 0: not determined
  double energy = 0;  ///< 2^-46 of the smallest scale of their energies [energy]
};

/// Keeps unwrapped positions where the tilt of their box has become this number of edges shorter. Throws
/// Error(Failure::numerical) for images that cannot be counted.
template <int D>
void renumber_images(Particles<D>& particles, std::int32_t boxes) {
  for (std::size_t i = 0; boxes != 0 && i < particles.image.size(); ++i) {
    const std::int64_t x = particles.image[i][0] + std::int64_t{boxes} * particles.image[i][1];
    if (std::abs(x) > std::numeric_limits<std::int32_t>::max())
      throw Error(Failure::numerical,
                  "the flow has carried a particle across the periodic box more often than 32 bits can count; end the "
                  "run earlier, or start a new one from its last state");
    particles.image[i][0] = static_cast<std::int32_t>(x);
  }
}

/// Must be on the heap and never move: interactions refer to its box and particles, the registry to its arrays.
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
    fields.add_value("tilt", box.tilt);
  }
  System(const System&) = delete;
  System& operator=(const System&) = delete;

  Box<D> box;
  Particles<D> particles;                           ///< particles on this rank; with one rank, all
  std::vector<std::string> species = {"particle"};  ///< names
  std::vector<std::unique_ptr<Interaction<D>>> interactions;
  Quanta quanta{};  ///< set before the first force pass
  Fields fields;    ///< all data of each particle
  Decomposition<D> decomposition{*this};

  /// The number of particles on all ranks, also while event cores hold them.
  std::size_t size() const { return decomposition.total(); }
  /// The number of those that are not fixed; set by count_moving().
  std::size_t moving() const { return size() - fixed_; }
  bool has_fixed() const { return fixed_ > 0; }
  /// Counts the fixed particles. Call when the particles are complete, before they are divided among ranks. Collective.
  void count_moving();

  /// Whether the total momentum is conserved: no walls, no shear, no kicks or friction of a bath, no fixed particles,
  /// no external field.
  bool keeps_momentum() const {
    return !box.has_walls() && !box.sheared() && box.bath.keeps_momentum() && !has_fixed() &&
           std::ranges::all_of(interactions, [](const auto& term) { return term->keeps_momentum(); });
  }

  /// Registers the spins if contacts are rough; they are zero where none are given. Call before the particles are
  /// divided among ranks or restored.
  void need_spins() {
    if (!box.contacts.rough()) return;
    particles.spin.resize(particles.mass.size(), Spin<D>::Zero());
    fields.add("spin", particles.spin);
  }

  /// Wraps all particles into the periodic box, and shortens its tilt. Called only at the ends of slabs. Throws
  /// Error(failure) if a particle has crossed it too often to count.
  void wrap(Failure failure = Failure::numerical) {
    if (box.sheared()) renumber_images(particles, box.shorten_tilt());
    for (std::size_t i = 0; i < particles.size(); ++i) box.wrap(particles.x[i], particles.image[i], failure);
  }

  /// Throws Error(Failure::initial_state) if arrays of the particles differ in length, positions or velocities are not
  /// finite, masses, radii or edges are not positive, a fixed particle moves, or a species is unknown.
  void check() const;

 private:
  std::size_t fixed_ = 0;
};

/// The mean distance (V/N)^(1/D) [length].
template <int D>
double mean_distance(const System<D>& system) {
  return elementary::pow(system.box.volume() / static_cast<double>(std::max<std::size_t>(1, system.size())), 1.0 / D);
}

}  // namespace carom
