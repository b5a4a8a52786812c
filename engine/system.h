#pragma once
// Everything that moves and what it feels: the state an integrator advances.

#include <memory>
#include <string>
#include <vector>

#include "engine/box.h"
#include "engine/interaction.h"
#include "engine/particles.h"

namespace carom {

class Exchange;
template <int D>
class Part;

/// Lives on the heap and is never moved: interactions refer to its box and particles.
template <int D>
struct System {
  System() = default;
  System(const System&) = delete;
  System& operator=(const System&) = delete;

  Box<D> box;
  Particles<D> particles;
  std::vector<std::string> species;
  std::vector<std::unique_ptr<Interaction<D>>> interactions;
  Exchange* ranks = nullptr;  ///< that advance this system together, each with the same state; null: one
  Part<D>* part = nullptr;    ///< what this rank does of it, where they share the work on forces

  /// Brings all particles back into the periodic box. Called at slab ends only: a pure function of the records.
  void wrap();
};

template <int D>
void System<D>::wrap() {
  for (std::size_t i = 0; i < particles.size(); ++i) box.wrap(particles.x[i], particles.image[i]);
}

}  // namespace carom
