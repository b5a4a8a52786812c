// SPDX-License-Identifier: BSD-3-Clause
#include "engine/integrators/registry.h"

#include <algorithm>
#include <iterator>

namespace carom {

const std::vector<IntegratorInfo>& integrators() {
  static const std::vector<IntegratorInfo> all = {
      integrator::free_flight(), integrator::verlet(), integrator::psa(),  integrator::cva(),
      integrator::mcva(),        integrator::cdda(),   integrator::edda(),
  };
  return all;
}

template <int D>
std::string IntegratorInfo::refusal(const Interaction<D>& term, bool fixed) const {
  if (smooth_forces) return "";
  if (!term.common_acceleration())
    return std::string(name) +
           " knows no forces but a uniform-field; leave the interaction out, or take psa, edda or their relatives";
  if (!fixed) return "";
  return std::string(name) +
         " knows no fixed particles in a uniform-field, where all particles have the same acceleration; leave the "
         "field "
         "out, let all particles move, or take psa, edda or their relatives";
}
std::string IntegratorInfo::refusal_of_steps() const {
  if (steps) return "";
  std::string able;
  for (const IntegratorInfo& each : integrators())
    if (each.steps) able.append(able.empty() ? "" : ", ").append(each.name);
  return std::string("'").append(name).append("' does not know steps of the pair energy; take one of: ").append(able);
}

template <int D>
std::string IntegratorInfo::refusal_of_shear(const System<D>& system, bool fixed) const {
  const Box<D>& box = system.box;
  if (!box.sheared()) return "";
  if (!shear)
    return std::string("'").append(name).append(
        "' knows no shear yet; take free-flight, psa, verlet or edda, or leave 'shear' out");
  for (const int k : {0, 1})
    if (!box.periodic(k))
      return "'shear' needs an axis " + std::to_string(k) +
             " that is periodic, because images of the box slide along x and follow each other along y; make it "
             "periodic, or leave 'shear' out";
  if (!box.steps.empty()) return "'shear' does not go with [[step]] yet; leave one of them out";
  if (fixed)
    return "fixed particles do not move with the flow of 'shear'; let all particles move, or leave 'shear' out";
  if (stepping && !box.contacts.elastic())
    return "'shear' goes with [[contact]] in free-flight only; take free-flight, or leave one of them out";
  if (stepping && std::ranges::any_of(box.options, [](const auto& wall) { return wall.temperature > 0; }))
    return "'shear' goes with thermal walls in free-flight only; take free-flight, or leave one of them out";
  if (stepping && std::ranges::any_of(system.interactions, [](const auto& term) { return !term->knows_shear(); }))
    return "'shear' goes with bonds and with pair forces whose cutoff is shorter than each periodic edge, not with "
           "fields, Ewald sums or forces without a cutoff; give a cutoff, or leave one of them out";
  return "";
}

template std::string IntegratorInfo::refusal_of_shear(const System<2>&, bool) const;
template std::string IntegratorInfo::refusal_of_shear(const System<3>&, bool) const;
template std::string IntegratorInfo::refusal(const Interaction<2>&, bool) const;
template std::string IntegratorInfo::refusal(const Interaction<3>&, bool) const;

const IntegratorInfo& find_integrator(std::string_view name) { return find_named(integrators(), "integrator", name); }

namespace parameter {

Parameter step() {
  return {.name = "step",
          .type = Parameter::Type::real,
          .fallback = "",
          .unit = "time",
          .meaning = "length of one step",
          .range = Parameter::Range::positive};
}

Parameter longest_step() {
  return {.name = "longest_step",
          .type = Parameter::Type::real,
          .fallback = "0",
          .unit = "time",
          .meaning =
              "as the particles of a gas with inelastic contacts become slower, its steps become longer, so that a "
              "path of thermal speed keeps its length, up to this; whole multiples of step; 0: all are of "
              "length step",
          .range = Parameter::Range::non_negative};
}

std::vector<Parameter> with_adaptive_steps(std::vector<Parameter> own) {
  Parameter first = step(), longest = longest_step();
  first.fallback = "none";
  first.meaning =
      "length of one step; if it is left out, or with `accuracy`, the method chooses its steps, and this is the first "
      "one";
  longest.meaning =
      "the longest step that the method chooses; 0: any. With fixed steps: as the particles of a gas with inelastic "
      "contacts become slower, its steps become longer, so that a path of thermal speed keeps its length, up to this; "
      "whole multiples of step; 0: all are of length step";
  std::vector<Parameter> all = {
      first,
      {.name = "accuracy",
       .type = Parameter::Type::real,
       .fallback = "none",
       .unit = "-",
       .meaning =
           "the method chooses its steps so that the position of no particle is wrong by much more than this in "
           "one step, relative to the diameter of the particle (of a point: to the mean distance); 0: fixed steps; "
           "default: 1e-4 if no step is given, else 0",
       .range = Parameter::Range::non_negative},
      {.name = "shortest_step",
       .type = Parameter::Type::real,
       .fallback = "0",
       .unit = "time",
       .meaning = "the run ends with an error if `accuracy` needs a shorter step; 0: any",
       .range = Parameter::Range::non_negative},
      longest};
  std::ranges::move(own, std::back_inserter(all));
  all.push_back(max_events_per_step());
  return all;
}

Parameter max_events_per_step() {
  return {.name = "max_events_per_step",
          .type = Parameter::Type::integer,
          .fallback = "100000",
          .unit = "-",
          .meaning = "largest number of collisions in a step; more end the run with an error",
          .range = Parameter::Range::positive};
}

}  // namespace parameter
}  // namespace carom
