// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A heat bath for all particles: when its kicks come, and its temperature. Both are functions of the seed and the time,
// so a bath has no state.

#include "engine/base/random.h"
#include "engine/base/vec.h"

namespace carom {

struct Bath {
  enum class Type : std::uint8_t {
    none,
    andersen,   ///< replaces the velocity of a particle at random times (Andersen, J. Chem. Phys. 72 (1980) 2384)
    rescaling,  ///< scales all velocities at the end of each slab (Bussi, Donadio, Parrinello, J. Chem. Phys. 126
                ///< (2007) 014101)
  };
  Type type = Type::none;
  double temperature = 1, last_temperature = 1;  ///< at the start and at the end of a linear ramp [energy]
  double ramp_start = 0, ramp_end = 0;  ///< Simulation sets them to the ends of the run if they are equal [time]
  double rate = 1;                      ///< kicks of a particle per unit time; rescaling: 1/relaxation time [1/time]
  std::uint64_t seed = 1;               ///< seed of the random numbers

  bool kicks() const { return type == Type::andersen; }
  bool rescales() const { return type == Type::rescaling; }
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
