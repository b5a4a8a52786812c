#pragma once
// The particles of a run, in the order of their ids, as integrators and observers see them: all at the same time.
//
// Where several ranks share a system (engine/part.h) each has the particles it owns and copies of others, ghosts. It
// may have only some of all then: their numbers here follow the order of their ids.

#include <span>
#include <string>
#include <vector>

#include "engine/error.h"
#include "engine/vec.h"

namespace carom {

template <int D>
struct Particles {
  std::vector<Vec<D>> x;               ///< position of the centre [length]
  std::vector<Vec<D>> v;               ///< velocity [length/time]
  std::vector<double> mass;            ///< [mass], positive
  std::vector<double> radius;          ///< of the hard core [length], positive
  std::vector<double> charge;          ///< [charge]
  std::vector<std::uint16_t> species;  ///< index into System::species
  std::vector<Image<D>> image;  ///< box edges crossed since the start, by axis; unwrapped position = x + image·edge
  std::vector<char> ghost{};    ///< 1: another rank owns it; empty: there are no others
  std::vector<Id> id{};         ///< ascending; empty: 0, 1, …

  std::size_t size() const { return x.size(); }
  bool owns(Id i) const { return ghost.empty() || ghost[i] == 0; }
  Id id_of(Id i) const { return id.empty() ? i : id[i]; }
};

/// Throws Error(Failure::numerical) where one of these positions of the particles is not finite.
template <int D>
void need_finite(const Particles<D>& particles, std::span<const Vec<D>> x) {
  for (Id i = 0; i < x.size(); ++i)
    if (!x[i].allFinite())
      throw Error(Failure::numerical, "the position of particle " + std::to_string(particles.id_of(i)) +
                                          " is not finite; use a smaller integrator.step");
}

}  // namespace carom
