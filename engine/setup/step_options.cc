// SPDX-License-Identifier: BSD-3-Clause
#include "engine/setup/step_options.h"

#include "engine/base/error.h"
#include "engine/forces/potentials/options.h"

namespace carom {
namespace {

[[noreturn]] void refuse(const std::string& what, const std::string& remedy) {
  throw Error(Failure::deck, what + "; " + remedy);
}

std::vector<double> numbers(const Parameters& given, const char* key) {
  if (const auto* one = given.find<double>(key)) return {*one};
  const auto* all = given.find<std::vector<double>>(key);
  return all ? *all : std::vector<double>{};
}

/// The steps that `range`, `depth`, `unit`, `tether` and `core` describe.
PairSteps steps_of(const Parameters& given, bool listed) {
  PairSteps steps;
  const std::vector<double> range = numbers(given, "range"), depth = numbers(given, "depth");
  const bool of_contact = given.text("unit") == "contact";
  if (range.size() != depth.size())
    refuse("'range' has " + std::to_string(range.size()) + " numbers and 'depth' has " + std::to_string(depth.size()),
           "give a depth for each range");
  if (const auto* core = given.find<double>("core")) steps.core = *core;
  double inside = of_contact ? 1 : steps.core;
  for (std::size_t k = 0; k < range.size(); ++k) {
    if (!(range[k] >= (1 + Steps::kLeastSeparation) * inside))
      refuse("range " + short_text(range[k]) +
                 (k > 0 ? " is not above the range " + short_text(inside) + " before it"
                        : " is not above the contact distance" + std::string(of_contact ? ", 1 in its unit" : "")),
             k > 0 ? "give ranges in ascending order" : "a step lies outside the core: give a larger range");
    inside = range[k];
    const double beyond = k + 1 < depth.size() ? depth[k + 1] : 0;
    if (depth[k] == beyond)
      refuse("the energy does not jump at range " + short_text(range[k]), "leave this range and its depth out");
    steps.surfaces.push_back({.range = range[k], .of_contact = of_contact, .climb = depth[k] - beyond});
  }
  if (const auto* tether = given.find<double>("tether")) {
    if (of_contact && !range.empty())
      refuse("'tether' is a length, and 'range' is given in contact distances", "add unit = \"length\"");
    if (!(*tether >= (1 + Steps::kLeastSeparation) * (of_contact ? steps.core : inside)))
      refuse("the tether " + short_text(*tether) + " is not above " +
                 (range.empty() ? "the core " + short_text(steps.core) : "the range " + short_text(inside)),
             "give a larger tether");
    steps.surfaces.push_back({.range = *tether, .of_contact = false, .climb = std::numeric_limits<double>::infinity()});
  }
  if (!listed)
    for (const char* key : {"tether", "core"})
      if (given.has(key))
        refuse(std::string("'") + key + "' joins listed pairs, and 'between' names species",
               "give 'pairs', 'chain' or 'within' instead of 'between'");
  if (steps.surfaces.empty() && !(steps.core > 0))
    refuse("a step has neither 'range' nor 'tether' nor 'core'", "give a range and a depth, or a tether");
  return steps;
}

}  // namespace

const std::vector<Parameter>& step_parameters() {
  using enum Parameter::Type;
  using Range = Parameter::Range;
  static const std::vector<Parameter> all = {
      {"between", text_list, "none", "-", "two species whose pairs have these steps; \"*\": all species"},
      {"pairs", pair_list, "none", "-", "instead: the pairs of particles, by number from 0, that are bonded by them"},
      {"chain", boolean, "false", "-", "instead: bond each particle to the next"},
      {"chain_length", integer, "none", "-", "particles in each chain, in id order; absent: a single chain of all",
       Range::positive},
      {"within", real, "none", "length", "instead: bond the pairs that are at most this far apart in the initial state",
       Range::positive},
      {"range", real_or_list, "none", "unit",
       "the distance of a step, or an ascending list; a bond has the steps of its list and not those of its species",
       Range::positive},
      {"depth", real_or_list, "none", "energy",
       "the depth of the well within 'range'; negative: a shoulder. In a list, the depth between a range and the one "
       "before it"},
      {"unit",
       text,
       "\"contact\"",
       "-",
       "of 'range': the contact distance of the pair, or a length",
       Range::any,
       {"contact", "length"}},
      {"tether", real, "none", "length", "the largest distance of bonded pairs", Range::positive},
      {"core", real, "none", "length", "the smallest distance of bonded pairs; absent: the sum of their radii",
       Range::positive}};
  return all;
}

template <int D>
void add_step(Box<D>& box, std::span<const std::string> species, std::size_t particles, const Parameters& given) {
  const bool listed = given.has("pairs") || given.flag("chain") || given.has("within");
  if (listed == given.has("between"))
    refuse(listed ? "'between' and a list of pairs exclude each other" : "a step names no pairs",
           "give 'between', 'pairs', 'chain' or 'within'");
  const PairSteps steps = steps_of(given, listed);
  if (box.steps.empty()) box.steps.resize(species.size());
  if (listed) {
    const PairList bonds = options::bonds("step", given, particles);
    const std::uint32_t list = box.steps.add(steps);
    for (const auto& [i, j] : bonds) box.steps.bond(i, j, list);
    if (const auto [i, j] = box.steps.sort_bonds(); i != j)
      refuse("particles " + std::to_string(i) + " and " + std::to_string(j) + " are bonded by two [[step]]",
             "give all steps of a pair in one");
    return;
  }
  const auto& between = given.get<std::vector<std::string>>("between");
  if (between.size() != 2)
    refuse("'between' names " + std::to_string(between.size()) + " species", "give two, perhaps the same one twice");
  std::vector<std::size_t> partners[2];
  for (const int k : {0, 1}) {
    std::string known;
    for (std::size_t s = 0; s < species.size(); ++s) {
      if (between[k] == "*" || between[k] == species[s]) partners[k].push_back(s);
      known += species[s] + ", ";
    }
    if (partners[k].empty()) refuse("'" + between[k] + "' is no species", "give one of: " + known + "*");
  }
  const std::uint32_t list = box.steps.add(steps);
  for (const std::size_t one : partners[0])
    for (const std::size_t other : partners[1]) box.steps.set_pair(one, other, list);
}

template <int D>
void find_step_bonds(Parameters& given, const InteractionContext<D>& context) {
  if (!given.has("within")) return;
  const PairList bonds = options::bonds("step", given, context);
  given.erase("within");
  given.set("pairs", bonds);
}

template void add_step(Box<2>&, std::span<const std::string>, std::size_t, const Parameters&);
template void add_step(Box<3>&, std::span<const std::string>, std::size_t, const Parameters&);
template void find_step_bonds(Parameters&, const InteractionContext<2>&);
template void find_step_bonds(Parameters&, const InteractionContext<3>&);

}  // namespace carom
