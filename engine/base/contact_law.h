// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Laws of contacts: how much of the normal speed a contact gives back. A law belongs to two species, or to a species
// and a wall.

#include <algorithm>
#include <cstdint>
#include <vector>

#include "engine/base/elementary.h"
#include "engine/base/vec.h"

namespace carom {

/// The coefficient of restitution e: a contact turns the normal speed v of approach into e·v.
struct ContactLaw {
  double restitution = 1;  ///< e, where the exponent is 0
  double v0 = 0;           ///< of the power law e = min(1, (v/v0)^−exponent) (Bridges, Hatzes, Lin, Nature 309 (1984)
                           ///< 333, for ice) [length/time]
  double exponent = 0;     ///< 0: no power law
  double rest_speed = -1;  ///< see ContactLaws::slow [length/time]; negative: kRestFraction of the thermal speed

  /// Relative to the thermal speed: what slower approaches could lose is 1e-16 of the energy, the rounding of a sum.
  static constexpr double kRestFraction = 1e-8;

  bool elastic() const { return restitution == 1 && exponent == 0; }
  double slowest(double thermal_speed) const { return rest_speed < 0 ? kRestFraction * thermal_speed : rest_speed; }
  /// e for an approach at this speed; `slow`: below the rest speed.
  double at(double speed, double thermal_speed, double slow) const {
    if (!(speed >= slowest(thermal_speed))) return elastic() ? 1 : slow;
    return exponent == 0 ? restitution : std::min(1.0, elementary::pow(speed / v0, -exponent));
  }
};

/// The laws of all contacts; elastic where none is set.
class ContactLaws {
 public:
  double thermal_speed = 0;  ///< √(Σ m v²/(D Σ m)) at the start of the slab [length/time]
  /// e of approaches slower than the rest speed: 1 in free flight, which would otherwise need endless collisions in a
  /// finite time (Luding, McNamara, Granul. Matter 1 (1998) 113); 0 in methods with steps, which hold contacts at rest.
  double slow = 1;

  /// Whether all contacts are elastic.
  bool elastic() const { return laws_.empty(); }
  /// For this many species and wall numbers; all are elastic until set.
  void resize(std::size_t species, std::size_t walls) {
    species_ = species;
    columns_ = species + walls;
    if (laws_.empty()) laws_.resize(1);
    which_.resize(species * columns_);
  }
  /// Appends a law, for set_pair() and set_wall().
  std::uint16_t add(const ContactLaw& law) {
    laws_.push_back(law);
    return static_cast<std::uint16_t>(laws_.size() - 1);
  }
  void set_pair(std::size_t one, std::size_t other, std::uint16_t law) {
    which_[one * columns_ + other] = which_[other * columns_ + one] = law;
  }
  void set_wall(std::size_t species, std::size_t number, std::uint16_t law) {
    which_[species * columns_ + species_ + number] = law;
  }
  // Call these only if not all contacts are elastic.
  const ContactLaw& of_pair(std::uint16_t one, std::uint16_t other) const {
    return laws_[which_[one * columns_ + other]];
  }
  const ContactLaw& of_wall(std::uint16_t species, Id number) const {
    return laws_[which_[species * columns_ + species_ + number]];
  }
  const std::vector<ContactLaw>& all() const { return laws_; }

 private:
  std::size_t species_ = 0, columns_ = 0;
  std::vector<ContactLaw> laws_;      // the first is elastic
  std::vector<std::uint16_t> which_;  // by species and partner: species, then walls
};

}  // namespace carom
