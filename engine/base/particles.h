// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The particles of a run at one time, in the order of their ids, as integrators and observers access them.
//
// If a system is divided among ranks (engine/ranks/decomposition.h), each rank has the particles it owns and copies of
// others, the ghosts. If it does not have all particles, their numbers here still follow the order of ids.

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/vec.h"

namespace carom {

/// A sphere of infinite mass is fixed: it never moves, and others bounce off it.
inline bool is_fixed(double mass) { return std::isinf(mass); }
/// The mass in sums of energies and momenta: 0 for a fixed sphere, which has neither.
inline double moving_mass(double mass) { return is_fixed(mass) ? 0 : mass; }

/// The internal state of a sphere: what contacts change besides its record (record.h). Cores, traces, messages and
/// blocks pass it on without naming its parts; a new state is declared here and in Particles::for_each_internal().
template <int D>
struct Internal {
  Spin<D> spin = Spin<D>::Zero();  ///< angular velocity [1/time]

  bool operator==(const Internal&) const = default;
};

/// The argument of Particles::add().
template <int D>
struct Particle {
  Vec<D> x;                        ///< position of the centre [length]
  Vec<D> v = Vec<D>::Zero();       ///< velocity [length/time]
  double radius = 0.5;             ///< hard core [length]
  double mass = 1;                 ///< [mass]; infinite: the particle is fixed
  double charge = 0;               ///< [charge]
  std::uint16_t species = 0;       ///< index into System::species
  Spin<D> spin = Spin<D>::Zero();  ///< angular velocity [1/time]
};

/// A particle that another rank owns (Particles::ghost), and where its pairs with particles of this rank are evaluated.
enum Ghost : char {
  kGhost = 1,          ///< here or on the rank of its owner, as evaluated_with_first() tells
  kGhostHere = 2,      ///< here
  kGhostElsewhere = 3  ///< on the rank of its owner, which has partners within reach as kGhostHere
};

/// The rule for pairs with a kGhost, with these ids: the pair is evaluated on the rank of the first particle if this is
/// true, else on that of the second. Each rank evaluates about half of the pairs.
inline bool evaluated_with_first(Id a, Id b) { return ((a + b) % 2 == 0) == (a < b); }

template <int D>
struct Particles {
  std::vector<Vec<D>> x;               ///< position of the centre [length]
  std::vector<Vec<D>> v;               ///< velocity [length/time]
  std::vector<double> mass;            ///< [mass], positive; infinite: the particle is fixed, and its velocity is 0
  std::vector<double> radius;          ///< hard core [length], positive
  std::vector<double> charge;          ///< [charge]
  std::vector<std::uint16_t> species;  ///< index into System::species
  std::vector<Image<D>> image;  ///< box edges crossed since the start, by axis; unwrapped position = x + image·edge
  std::vector<Spin<D>> spin{};  ///< angular velocity [1/time]; may be empty unless contacts are rough
  std::vector<char> ghost{};    ///< a Ghost if another rank owns it, else 0; empty: this rank owns all
  std::vector<Id> id{};         ///< ascending; empty: 0, 1, …

  std::size_t size() const { return x.size(); }
  /// Appends a particle; returns its id.
  Id add(const Particle<D>& particle) {
    x.push_back(particle.x);
    v.push_back(particle.v);
    mass.push_back(particle.mass);
    radius.push_back(particle.radius);
    charge.push_back(particle.charge);
    species.push_back(particle.species);
    image.push_back({});
    if (!spin.empty() || particle.spin != Spin<D>::Zero()) {
      spin.resize(x.size(), Spin<D>::Zero());
      spin.back() = particle.spin;
    }
    return static_cast<Id>(x.size() - 1);
  }
  /// Calls visit(array, member of Internal) for each array of the internal state.
  template <class Visit>
  void for_each_internal(Visit&& visit) {
    visit(spin, &Internal<D>::spin);
  }
  /// The internal state of a particle; the arrays must not be empty.
  Internal<D> internal(Id i) const {
    Internal<D> state;
    const_cast<Particles*>(this)->for_each_internal([&](auto& array, auto member) { state.*member = array[i]; });
    return state;
  }
  void set_internal(Id i, const Internal<D>& state) {
    for_each_internal([&](auto& array, auto member) { array[i] = state.*member; });
  }
  void resize_internal(std::size_t n) {
    for_each_internal([&](auto& array, auto member) { array.resize(n, Internal<D>{}.*member); });
  }
  bool fixed(Id i) const { return is_fixed(mass[i]); }
  bool any_fixed() const { return std::ranges::any_of(mass, is_fixed); }
  /// 1 for each fixed particle; empty if there is none.
  std::vector<char> all_fixed() const {
    std::vector<char> fixed;
    if (any_fixed())
      for (const double m : mass) fixed.push_back(is_fixed(m) ? 1 : 0);
    return fixed;
  }
  bool owns(Id i) const { return ghost.empty() || ghost[i] == 0; }
  /// Whether this rank evaluates a pair of which it owns one particle; if not, the owner of the other one does.
  bool evaluates(Id i, Id j) const {
    if (owns(i) == owns(j)) return owns(i);
    const char kind = ghost[owns(i) ? j : i];
    return kind == kGhost ? owns(evaluated_with_first(id_of(i), id_of(j)) ? i : j) : kind == kGhostHere;
  }
  Id id_of(Id i) const { return id.empty() ? i : id[i]; }
};

/// Throws Error(Failure::numerical) if one of these positions is not finite.
template <int D>
void need_finite(const Particles<D>& particles, std::span<const Vec<D>> x) {
  for (Id i = 0; i < x.size(); ++i)
    if (!x[i].allFinite())
      throw Error(Failure::numerical, "the position of particle " + std::to_string(particles.id_of(i)) +
                                          " is not finite; use a smaller integrator.step");
}

}  // namespace carom
