// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Steps: distances at which the energy of a pair of spheres jumps. Square wells and shoulders act between species;
// tethers and hard bonds join listed pairs.
//
// u(r) is constant between the distances of neighbouring steps. A pair that reaches a step crosses it if its relative
// motion along the line of centres has the energy for that, and bounces off it otherwise (events/step_event.h).

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "engine/base/vec.h"

namespace carom {

/// The distance at which the energy of a pair jumps.
struct StepSurface {
  double range = 0;        ///< in contact distances if `of_contact`, else [length]
  bool of_contact = true;  ///< else `range` is a length
  double climb = 0;        ///< the energy that a pair needs to get out; infinite: it never gets out [energy]

  /// `sigma`: the contact distance.
  double distance(double sigma) const { return of_contact ? range * sigma : range; }
  bool tether() const { return climb == std::numeric_limits<double>::infinity(); }
};

/// All steps of a pair, from the inside out; only the last can be a tether.
struct PairSteps {
  std::vector<StepSurface> surfaces;
  double core = 0;  ///< the smallest distance; 0: the sum of the radii [length]

  double core_distance(double sigma) const { return core > 0 ? core : sigma; }
  /// The largest distance at which something happens to the pair.
  double farthest(double sigma) const {
    return surfaces.empty() ? core_distance(sigma) : surfaces.back().distance(sigma);
  }
};

/// The largest distance at which something can happen to a pair, as a function of the radii: of two spheres it is the
/// sum of their reaches.
struct Reach {
  double radii = 1;  ///< relative to the radius
  double least = 0;  ///< [length]

  /// Half the largest distance at which two spheres with this radius can have an event. The widths of lists, cells,
  /// halos and windows follow from it; the radius of the hard core is used only where a contact is computed.
  double operator()(double radius) const { return std::max(radii * radius, least); }
  std::vector<double> operator()(std::vector<double> radius) const {
    for (double& each : radius) each = (*this)(each);
    return radius;
  }
};

/// The steps of all pairs.
class Steps {
 public:
  /// The least distance of two steps of a pair, or of a step and the core, relative to the contact distance: a pair
  /// that reaches one must be able to tell which one it is (kJustMet in events/step_event.h).
  static constexpr double kLeastSeparation = 1e-6;

  bool empty() const { return lists_.empty(); }
  /// For this many species; pairs have no steps until they are set.
  void resize(std::size_t species) {
    species_ = species;
    of_species_.assign(species * species, kNone);
  }
  /// Appends steps, for set_pair() and bond().
  std::uint32_t add(PairSteps steps) {
    for (const StepSurface& each : steps.surfaces) {
      if (each.of_contact) reach_.radii = std::max(reach_.radii, each.range);
      if (!each.of_contact) reach_.least = std::max(reach_.least, 0.5 * each.range);
      if (!each.tether()) least_climb_ = std::min(least_climb_, std::abs(each.climb));
    }
    reach_.least = std::max(reach_.least, 0.5 * steps.core);
    lists_.push_back(std::move(steps));
    return static_cast<std::uint32_t>(lists_.size() - 1);
  }
  void set_pair(std::size_t one, std::size_t other, std::uint32_t list) {
    of_species_[one * species_ + other] = of_species_[other * species_ + one] = list;
  }
  /// Gives particles i and j these steps instead of the ones of their species. Call sort_bonds() after the last one.
  void bond(Id i, Id j, std::uint32_t list) {
    bonds_.push_back({i, j, list});
    bonds_.push_back({j, i, list});
  }
  /// Returns two ids that are bonded twice; both are 0 if there are none.
  std::array<Id, 2> sort_bonds();

  /// The steps of a bond; null: the two are not bonded.
  const PairSteps* find_bond(Id i, Id j) const {
    if (i < first_bond_.size())
      for (std::uint32_t k = first_bond_[i]; k < bonds_.size() && bonds_[k].i == i; ++k)
        if (bonds_[k].j == j) return &lists_[bonds_[k].list];
    return nullptr;
  }
  /// The steps of two particles with these ids and species; null: they have none.
  const PairSteps* find(Id i, std::uint16_t species_i, Id j, std::uint16_t species_j) const {
    if (const PairSteps* const bond = find_bond(i, j)) return bond;
    return of_species(species_i, species_j);
  }
  /// The steps of two species; null: they have none.
  const PairSteps* of_species(std::size_t one, std::size_t other) const {
    const std::uint32_t list = of_species_[one * species_ + other];
    return list == kNone ? nullptr : &lists_[list];
  }
  /// The steps of every pair; null: pairs differ, or have none.
  const PairSteps* of_all() const {
    const bool same = std::ranges::adjacent_find(of_species_, std::ranges::not_equal_to()) == of_species_.end();
    return same && bonds_.empty() && !of_species_.empty() ? of_species(0, 0) : nullptr;
  }
  /// The number of bonds.
  std::size_t bonds() const { return bonds_.size() / 2; }
  /// The number of tethered pairs.
  std::size_t tethers() const {
    std::size_t number = 0;
    for_each_bond(
        [&](Id, Id, const PairSteps& list) { number += !list.surfaces.empty() && list.surfaces.back().tether(); });
    return number;
  }
  /// The contact distance of two particles with the sum of radii `sigma`: that of their bond, if it has one.
  double core_distance(Id i, Id j, double sigma) const {
    const PairSteps* const bond = find_bond(i, j);
    return bond ? bond->core_distance(sigma) : sigma;
  }
  /// Calls visit(i, j, steps) for each bond.
  template <class Visit>
  void for_each_bond(Visit&& visit) const {
    for (const Bond& bond : bonds_)
      if (bond.i < bond.j) visit(bond.i, bond.j, lists_[bond.list]);
  }
  Reach reach() const { return reach_; }
  /// The smallest finite jump of an energy; infinite if there is none [energy].
  double least_climb() const { return least_climb_; }

 private:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  struct Bond {
    Id i, j;
    std::uint32_t list;
  };
  std::size_t species_ = 0;
  std::vector<std::uint32_t> of_species_;  // by species and species
  std::vector<PairSteps> lists_;
  std::vector<Bond> bonds_;                // each twice, ordered by i and j
  std::vector<std::uint32_t> first_bond_;  // by id
  Reach reach_;
  double least_climb_ = std::numeric_limits<double>::infinity();
};

inline std::array<Id, 2> Steps::sort_bonds() {
  std::ranges::sort(bonds_, {}, [](const Bond& bond) { return std::pair(bond.i, bond.j); });
  first_bond_.clear();
  for (std::uint32_t k = 0; k < bonds_.size(); ++k) {
    if (k > 0 && bonds_[k].i == bonds_[k - 1].i && bonds_[k].j == bonds_[k - 1].j) return {bonds_[k].i, bonds_[k].j};
    while (first_bond_.size() <= bonds_[k].i) first_bond_.push_back(k);
  }
  return {0, 0};
}

}  // namespace carom
