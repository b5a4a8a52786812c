// SPDX-License-Identifier: BSD-3-Clause
#include "engine/forces/potentials/options.h"

#include <algorithm>

#include "engine/base/error.h"

namespace carom::options {

std::vector<Parameter> with_filter(std::vector<Parameter> own) {
  using enum Parameter::Type;
  own.push_back({"species", text_list, "none", "-",
                 "the names of two species between which the term acts; absent: all particles"});
  own.push_back(
      {"exclude",
       text,
       "\"none\"",
       "-",
       "'bonded': the term does not act between particles that a harmonic-bond or a [[step]] with a list joins",
       Parameter::Range::any,
       {"none", "bonded"}});
  return own;
}

std::vector<Parameter> with_cut(std::vector<Parameter> own, std::string_view absent_cutoff) {
  using enum Parameter::Type;
  own = with_filter(std::move(own));
  own.push_back({"cutoff", real, "none", "length", std::string(absent_cutoff), Parameter::Range::positive});
  own.back().most = 1e100;  // its square is a number
  own.push_back(
      {"cut",
       text,
       "\"switch\"",
       "-",
       "how it ends: 'switch' leaves V unchanged up to switch_from, beyond which V, V' and V'' go to zero smoothly; "
       "'shifted' subtracts V(cutoff), so that the force jumps at the cutoff, which reduces the order of time-stepping "
       "methods; 'force-shifted' subtracts a function linear in r, so that V and the force go to zero",
       Parameter::Range::any,
       {"switch", "shifted", "force-shifted"},
       {{"smooth", "write cut = \"switch\", which leaves V unchanged up to switch_from"}}});
  own.push_back({"switch_from", real, "none", "length",
                 "where cut = 'switch' begins to differ from V; absent: 0.9 of the cutoff",
                 Parameter::Range::positive});
  return own;
}

std::vector<Parameter> with_pair_options(std::vector<Parameter> own) {
  own =
      with_cut(std::move(own),
               "distance at which the potential ends; required in a periodic box, where all images within it count, a "
               "particle's own too; absent: it does not end");
  own.push_back(
      {"tail", Parameter::Type::boolean, "false", "-",
       "whether the reported energies and pressures include the contribution of a uniform fluid beyond the cutoff; "
       "with 'shifted' it is that of the truncated potential, without the shift"});
  return own;
}

CutOptions cut_options(std::string_view type, const Parameters& parameters, double end) {
  const double cutoff = parameters.has("cutoff") ? parameters.real("cutoff") : end;
  const std::string cut = parameters.has("cut") ? parameters.text("cut") : "switch";
  const bool switched = cut == "switch";
  if (!switched && parameters.has("switch_from"))
    refuse(type, "'switch_from' belongs to cut = \"switch\"; leave it out or change 'cut'");
  const double from = parameters.has("switch_from") ? parameters.real("switch_from") : 0.9 * cutoff;
  if (from >= cutoff) refuse(type, "'switch_from' is not below the cutoff; give a smaller distance");
  const CutKind kind = switched ? CutKind::switched : cut == "shifted" ? CutKind::shifted : CutKind::force_shifted;
  return {cutoff, kind, from};
}

void refuse_cut_options(std::string_view type, const Parameters& parameters) {
  if (parameters.has("switch_from") || (parameters.has("tail") && parameters.flag("tail")))
    refuse(type, "'switch_from' and 'tail' are for potentials with an end; give 'cutoff'");
}

void refuse(std::string_view type, const std::string& problem) {
  throw Error(Failure::deck, std::string(type) + ": " + problem);
}

namespace {

std::uint16_t species_index(std::string_view type, const std::string& name, const std::vector<std::string>& known) {
  const auto at = std::ranges::find(known, name);
  if (at != known.end()) return static_cast<std::uint16_t>(at - known.begin());
  std::string list;
  for (const std::string& other : known) list.append(list.empty() ? "'" : ", '").append(other).append("'");
  refuse(type, "'species' names '" + name + "', which is not there; known species: " + list);
}

}  // namespace

SpeciesPair species_pair(std::string_view type, const Parameters& parameters, const std::vector<std::string>& known) {
  if (!parameters.has("species")) return {};
  const auto& names = parameters.get<std::vector<std::string>>("species");
  if (names.size() != 2)
    refuse(type, "'species' has " + std::to_string(names.size()) + " entries; give the two species it acts between");
  return std::array{species_index(type, names[0], known), species_index(type, names[1], known)};
}

PairList bonds(std::string_view type, const Parameters& parameters, std::size_t particles) {
  const bool chain = parameters.has("chain") && parameters.flag("chain");
  const int given = (chain ? 1 : 0) + (parameters.has("pairs") ? 1 : 0) + (parameters.has("within") ? 1 : 0);
  if (given == 0) refuse(type, "no bonds are given; give 'pairs = [[0, 1], …]', 'chain = true' or 'within'");
  if (given > 1) refuse(type, "bonds are given twice, by two of 'pairs', 'chain' and 'within'; give one of them");
  if (parameters.has("chain_length") && !chain)
    refuse(type, "'chain_length' is given without a chain; add 'chain = true'");
  if (parameters.has("within")) return {};
  PairList list;
  if (chain) {
    const std::size_t length =
        parameters.has("chain_length") ? static_cast<std::size_t>(parameters.integer("chain_length")) : particles;
    for (Id i = 1; i < particles; ++i)
      if (i % length != 0) list.push_back({i - 1, i});
    return list;
  }
  list = parameters.get<PairList>("pairs");
  for (auto& [i, j] : list) {
    const std::string name = "pair [" + std::to_string(i) + ", " + std::to_string(j) + "]";
    if (std::max(i, j) >= particles)
      refuse(type, name + " names particle " + std::to_string(std::max(i, j)) + ", but there are only " +
                       std::to_string(particles) + " particles, counted from 0; correct 'pairs'");
    if (i == j) refuse(type, name + " bonds a particle to itself; correct 'pairs'");
    if (i > j) std::swap(i, j);
  }
  std::ranges::sort(list);
  const auto twice = std::ranges::adjacent_find(list);
  if (twice != list.end())
    refuse(type, "pair [" + std::to_string((*twice)[0]) + ", " + std::to_string((*twice)[1]) +
                     "] is given twice; leave one of the two out");
  return list;
}

}  // namespace carom::options
