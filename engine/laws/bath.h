// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A heat bath for all particles: when its kicks come, and its temperature. Both are functions of the seed and the time,
// so a bath has no state.

#include <algorithm>
#include <vector>

#include "engine/base/random.h"
#include "engine/base/vec.h"

namespace carom {

struct Bath {
  enum class Type : std::uint8_t {
    none,
    andersen,   ///< replaces the velocity of a particle at random times (Andersen, J. Chem. Phys. 72 (1980) 2384)
    rescaling,  ///< scales all velocities at the end of each slab (Bussi, Donadio, Parrinello, J. Chem. Phys. 126
                ///< (2007) 014101)
    langevin,  ///< friction and noise at the end of each slab: the exact solution of dv = −γ v dt + √(2 γ kT/m) dW
  };
  Type type = Type::none;
  double temperature = 1, last_temperature = 1;  ///< at the start and at the end of a linear ramp [energy]
  double ramp_start = 0, ramp_end = 0;  ///< Simulation sets them to the ends of the run if they are equal [time]
  std::vector<double> friction{};       ///< γ of a Langevin bath: one number, or one for each species [1/time]
  double rate = 1;                      ///< kicks of a particle per unit time; rescaling: 1/relaxation time [1/time]
  std::uint64_t seed = 1;               ///< seed of the random numbers

  bool kicks() const { return type == Type::andersen; }
  bool rescales() const { return type == Type::rescaling; }
  bool damps() const { return type == Type::langevin; }
  /// Whether it acts at the ends of slabs, on a time of its own.
  bool acts_at_ends() const { return rescales() || damps(); }
  bool keeps_momentum() const { return type == Type::none || rescales(); }
  double friction_of(std::uint16_t species) const { return friction[friction.size() == 1 ? 0 : species]; }
  /// The rate at which it relaxes what it acts on at the ends of slabs [1/time].
  double relaxation_rate() const { return damps() ? *std::max_element(friction.begin(), friction.end()) : rate; }
  bool has_ramp() const { return temperature != last_temperature; }
  bool needs_ramp_time() const { return type != Type::none && has_ramp() && ramp_start == ramp_end; }
  void set_temperature(double constant) { temperature = last_temperature = constant; }
  double temperature_at(double time) const {
    if (!has_ramp() || time <= ramp_start) return temperature;
    if (time >= ramp_end) return last_temperature;
    return temperature + (time - ramp_start) / (ramp_end - ramp_start) * (last_temperature - temperature);
  }
  /// The time of the first kick of a particle after time t; both count from `origin`. Later kicks than `until` may be
  /// left out (kNever).
  double next_kick(Id id, double origin, double t, double until) const;
};

}  // namespace carom
