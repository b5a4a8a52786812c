// SPDX-License-Identifier: BSD-3-Clause
#include "engine/laws/bath_options.h"

#include "engine/base/error.h"

namespace carom {

const std::vector<Parameter>& bath_parameters() {
  using enum Parameter::Type;
  using Range = Parameter::Range;
  static const std::vector<Parameter> all = {
      {"type",
       text,
       "",
       "-",
       "andersen: at random times a particle gets a new velocity from the distribution of Maxwell and Boltzmann, in "
       "methods with steps at the end of the step; "
       "rescaling: all velocities are scaled by a common random factor, so that the kinetic energy is canonical; "
       "langevin: friction and noise at the end of each step or epoch",
       Range::any,
       {"andersen", "rescaling", "langevin"}},
      {"temperature", real_or_list, "", "energy", "a number, or [first, last]: a linear ramp", Range::positive},
      {"ramp_time", real_list, "none", "time",
       "[start, end] of the ramp, before and after which the temperature is constant; default: start and end of the "
       "run. It stays if the run is continued to another end"},
      {"rate", real, "none", "1/time", "andersen: kicks of a particle per unit time; rescaling: 1/relaxation time",
       Range::positive},
      {"friction", real_or_list, "none", "1/time",
       "langevin: the rate at which friction damps velocities, or a list with one for each species", Range::positive},
      {"seed", integer, "none", "-", "seed of the random numbers; default: that of [placement]", Range::non_negative}};
  return all;
}

Bath bath_of(const Parameters& given, std::uint64_t seed) {
  const std::string& type = given.text("type");
  Bath bath{.type = type == "andersen"    ? Bath::Type::andersen
                    : type == "rescaling" ? Bath::Type::rescaling
                                          : Bath::Type::langevin,
            .seed = seed};
  for (const char* key : {"rate", "friction"}) {
    const bool wanted = bath.damps() == (key == std::string_view("friction"));
    if (given.has(key) != wanted)
      throw Error(Failure::deck, "a bath of type " + type + (wanted ? " needs '" : " has no '") + key + "'; " +
                                     (wanted         ? "add it: a number in 1/time"
                                      : bath.damps() ? "give 'friction'"
                                                     : "give 'rate'"));
  }
  if (const auto* rate = given.find<double>("rate")) bath.rate = *rate;
  if (const auto* one = given.find<double>("friction")) bath.friction = {*one};
  if (const auto* all = given.find<std::vector<double>>("friction")) bath.friction = *all;
  if (const auto* own = given.find<std::int64_t>("seed")) bath.seed = static_cast<std::uint64_t>(*own);
  if (bath.damps() && bath.friction.empty())
    throw Error(Failure::deck, "'friction' is an empty list; give one number, or one for each species");
  if (const auto* constant = given.find<double>("temperature")) bath.set_temperature(*constant);
  if (const auto* ramp = given.find<std::vector<double>>("temperature")) {
    if (ramp->size() != 2)
      throw Error(Failure::deck, "the temperature of the bath has " + std::to_string(ramp->size()) +
                                     " numbers; give one, or the first and the last of a ramp");
    bath.temperature = ramp->front();
    bath.last_temperature = ramp->back();
  }
  if (const auto* times = given.find<std::vector<double>>("ramp_time")) {
    if (times->size() != 2 || !(times->front() < times->back()))
      throw Error(Failure::deck, "the ramp_time of the bath is not two times, one after the other; give [start, end]");
    bath.ramp_start = times->front();
    bath.ramp_end = times->back();
  }
  return bath;
}

}  // namespace carom
