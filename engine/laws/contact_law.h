// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Laws of contacts: how much of the normal and of the tangential velocity a contact gives back. A law belongs to two
// species, or to a species and a wall.

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "engine/base/elementary.h"
#include "engine/base/vec.h"

namespace carom {

/// What a law may depend on: the normal speed at which spheres, or a sphere and a wall, approach before the contact,
/// and the inverse of their reduced mass, 1/m_a + 1/m_b.
struct Approach {
  double speed, inverse_mass;
};

/// A contact turns the normal speed v of approach into e·v and the tangential velocity s of the two surfaces into −β·s,
/// unless that takes a tangential impulse of more than μ times the normal one (Walton, in: Particulate Two-Phase Flow
/// (1993) 884).
struct ContactLaw {
  double restitution = 1;  ///< e, where the exponent is 0
  double v0 = 0;           ///< of the power law e = min(1, (v/v0)^−exponent) (Bridges, Hatzes, Lin, Nature 309 (1984)
                           ///< 333, for ice) [length/time]
  double exponent = 0;     ///< 0: no power law
  std::optional<double> tangential{};  ///< β: −1 smooth, 0 the surfaces stick, 1 their velocity is reversed; none: no
                                       ///< spins
  double friction = std::numeric_limits<double>::infinity();  ///< μ
  /// Below it ContactLaws::restitution_when_slow applies [length/time]; negative: kRestFraction of the thermal speed,
  /// and in methods with steps at least RestCriterion::rest_speed().
  double rest_speed = -1;

  /// Relative to the thermal speed: what slower approaches could lose is 1e-16 of the energy, the rounding of a sum.
  static constexpr double kRestFraction = 1e-8;

  /// Whether the normal speed is kept.
  bool elastic() const { return restitution == 1 && exponent == 0; }
  /// Whether contacts change spins.
  bool rough() const { return tangential.has_value(); }
  /// Whether a contact with this normal speed of approach changes spins; slower ones are smooth.
  bool rubs(double speed, double thermal_speed) const { return rough() && speed >= slowest(thermal_speed); }
  double slowest(double thermal_speed) const { return rest_speed < 0 ? kRestFraction * thermal_speed : rest_speed; }
  /// e for an approach; `when_slow`: below the rest speed.
  double restitution_at(const Approach& approach, double thermal_speed, double when_slow) const {
    const double speed = approach.speed;
    if (!(speed >= slowest(thermal_speed))) return elastic() ? 1 : when_slow;
    return exponent == 0 ? restitution : std::min(1.0, elementary::pow(speed / v0, -exponent));
  }
};

/// The laws of all contacts; elastic where none is set.
class ContactLaws {
 public:
  double thermal_speed = 0;  ///< √(Σ m v²/(D Σ m)) at the start of the slab [length/time]
  /// e of approaches slower than the rest speed: 1 in free flight, which would otherwise need endless collisions in a
  /// finite time (Luding, McNamara, Granul. Matter 1 (1998) 113); 0 in methods with steps, which hold contacts at rest.
  double restitution_when_slow = 1;

  /// Whether all contacts are elastic and smooth.
  bool elastic() const { return laws_.empty(); }
  /// Whether any contact changes spins.
  bool rough() const { return rough_; }
  /// Whether contacts depend on the internal state of spheres (Internal). If not, no core or message carries it.
  bool need_internal() const { return rough_; }
  /// The reduced moment of inertia κ = 4I/mσ² = I/mr² of each species; homogeneous ones where it is 0 or missing.
  std::vector<double> inertias;
  /// κ of a homogeneous disc or sphere.
  static constexpr double homogeneous(int dimension) { return dimension == 2 ? 0.5 : 0.4; }
  /// κ of a ring, or of a sphere whose mass is in its surface.
  static constexpr double largest_inertia(int dimension) { return dimension == 2 ? 1 : 2.0 / 3; }
  double inertia(std::size_t species, int dimension) const {
    return species < inertias.size() && inertias[species] > 0 ? inertias[species] : homogeneous(dimension);
  }
  /// The moment of inertia of a sphere of this species [mass · length²].
  double moment(std::size_t species, double mass, double radius, int dimension) const {
    return inertia(species, dimension) * mass * radius * radius;
  }
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
    rough_ = rough_ || law.rough();
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
  bool rough_ = false;
  std::vector<ContactLaw> laws_;      // the first is elastic
  std::vector<std::uint16_t> which_;  // by species and partner: species, then walls
};

}  // namespace carom
