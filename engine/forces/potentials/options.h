// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Parameters shared by many types of interaction, and how they are read.
//
// All functions throw Error(Failure::deck); the message begins with the type's name and says what to do.

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "engine/forces/potentials/cut.h"
#include "engine/forces/potentials/pair_term.h"
#include "engine/forces/potentials/tail.h"
#include "engine/laws/interaction.h"
#include "engine/ranks/halo.h"
#include "engine/search/neighbour_list.h"

namespace carom::options {

/// `own`, followed by the parameters that select pairs.
std::vector<Parameter> with_filter(std::vector<Parameter> own);

/// with_filter(), followed by cutoff, cut and switch_from.
std::vector<Parameter> with_cut(std::vector<Parameter> own, std::string_view absent_cutoff);

/// with_cut(), followed by tail: for potentials of infinite range.
std::vector<Parameter> with_pair_options(std::vector<Parameter> own);

[[noreturn]] void refuse(std::string_view type, const std::string& problem);

/// The two species in `species`, as indices into `known`.
SpeciesPair species_pair(std::string_view type, const Parameters& parameters, const std::vector<std::string>& known);

/// The values of `cutoff`, `cut` and `switch_from`; without `cutoff` the potential ends at `end`.
struct CutOptions {
  double cutoff;
  CutKind kind;
  double switch_from;
};
CutOptions cut_options(std::string_view type, const Parameters& parameters, double end = 0);

/// Refuses parameters of the cutoff if there is no `cutoff`.
void refuse_cut_options(std::string_view type, const Parameters& parameters);

/// The bonds that `pairs` or `chain` describe among this many particles, i < j, ascending; none for `within`.
PairList bonds(std::string_view type, const Parameters& parameters, std::size_t particles);

/// The bonds that `pairs`, `chain` or `within` describe, by ids, i < j, ascending: the whole list on each rank.
template <int D>
PairList bonds(std::string_view type, const Parameters& parameters, const InteractionContext<D>& context) {
  PairList list = bonds(type, parameters, context.total);
  if (!parameters.has("within") || !context.placed) return list;
  const double distance = parameters.real("within");
  const auto add = [&](const Particles<D>& p) {
    NeighbourList<D> near(context.box, std::vector<double>(p.x.size(), 0.5 * distance));
    for (const auto& [i, j, image] : near.cover(p.x)) {
      if (!p.owns(i) || !((p.x[i] - p.x[j] + context.box.shift(image)).norm() <= distance)) continue;
      const PairList::value_type bond{p.id_of(i), p.id_of(j)};
      if (list.empty() || list.back() != bond) list.push_back(bond);  // not again for another image
    }
  };
  if (context.ranks) {
    add(halo_of(context.box, distance, *context.ranks, context.particles));
    list = gather_values<PairList::value_type>(*context.ranks, list);
    std::ranges::sort(list);
  } else {
    add(context.particles);
  }
  if (list.empty()) refuse(type, "no particles stand within " + std::to_string(distance) + "; give a larger 'within'");
  return list;
}

/// A vector given as a list of D numbers.
template <int D>
Vec<D> vector(std::string_view type, const Parameters& parameters, std::string_view key) {
  const auto& given = parameters.get<std::vector<double>>(key);
  if (given.size() != D)
    refuse(type, "'" + std::string(key) + "' has " + std::to_string(given.size()) + " components; give " +
                     std::to_string(D) + ", as the system has " + std::to_string(D) + " dimensions");
  return Eigen::Map<const Vec<D>>(given.data());
}

/// The filter from `species` and `exclude`.
template <int D>
PairFilter filter(std::string_view type, const Parameters& parameters, const InteractionContext<D>& context) {
  const SpeciesPair species = species_pair(type, parameters, context.species);
  const bool exclude = parameters.has("exclude") && parameters.text("exclude") == "bonded";
  if (exclude && !context.bonds)
    refuse(
        type,
        "exclude = \"bonded\" leaves out bonded pairs, but there are no bonds; leave it out, or add a harmonic-bond or "
        "a [[step]] with 'pairs', 'chain' or 'within'");
  PairFilter filter;
  if (species) filter.species = {&context.particles.species, (*species)[0], (*species)[1]};
  if (exclude) filter.excluded = context.bonds, filter.id = &context.particles.id;
  return filter;
}

/// The smallest contact distance of the pairs on which a term acts [length]; 0 if there are none. Collective.
template <int D>
double least_contact(std::string_view type, const Parameters& parameters, const InteractionContext<D>& context) {
  constexpr double kNoContact = std::numeric_limits<double>::infinity();
  const SpeciesPair species = species_pair(type, parameters, context.species);
  const auto& radius = context.particles.radius;
  std::array<double, 2> least = {-kNoContact, -kNoContact};  // negative radius, for either species
  for (Id i = 0; i < radius.size(); ++i)
    for (std::size_t k = 0; k < 2; ++k)
      if (!species || context.particles.species[i] == (*species)[k]) least[k] = std::max(least[k], -radius[i]);
  if (context.ranks) context.ranks->largest(least);
  const double contact = -least[0] - least[1];
  return contact < kNoContact ? contact : 0;
}

/// A term over pairs from this source; its scale is that of `whole`, the potential before it was cut.
template <int D, Potential P, class Pairs>
std::unique_ptr<Interaction<D>> term(P potential, PairWeight weight, const InteractionContext<D>& context, Pairs pairs,
                                     const auto& whole, Tail tail = {}) {
  const auto scale = [whole](double distance) { return whole.scale(distance); };
  return std::make_unique<PairTerm<D, P, Pairs>>(context.particles, potential, weight, std::move(pairs), scale, tail);
}

/// A term over all pairs. Periodic boxes, where the sum does not exist, are refused; `remedy` says what to write
/// instead.
template <int D, Potential P>
std::unique_ptr<Interaction<D>> all_pairs(std::string_view type, P potential, PairWeight weight,
                                          const Parameters& parameters, const InteractionContext<D>& context,
                                          const std::string& remedy) {
  PairFilter pairs_of = filter(type, parameters, context);
  if (context.box.has(Boundary::periodic))
    refuse(type, "acts between all pairs, which a periodic box does not allow; " + remedy);
  return term<D>(potential, weight, context, AllPairs<D>(context.box, context.total, std::move(pairs_of)), potential);
}

/// A term over the pairs within the range of a potential of finite range, or of `whole` after it was cut.
template <int D, ShortRanged P>
std::unique_ptr<Interaction<D>> within_reach(std::string_view type, P potential, PairWeight weight,
                                             const Parameters& parameters, const InteractionContext<D>& context,
                                             const auto& whole, Tail tail = {}) {
  const double reach = std::sqrt(potential.cutoff_squared()) * (1 + 1e-15);
  PairsWithinCutoff<D> pairs(context.box, reach, filter(type, parameters, context));
  return term<D>(potential, weight, context, std::move(pairs), whole, tail);
}

/// The long-range correction of a term over all particles on all ranks.
template <int D, HasTail P>
Tail tail(std::string_view type, const Cut<P>& cut, CutKind kind, PairWeight weight, const Parameters& parameters,
          const InteractionContext<D>& context) {
  if (kind == CutKind::force_shifted)
    refuse(type, "'tail' does not go with cut = \"force-shifted\", which changes V at all distances; take \"switch\"");
  for (int k = 0; k < D; ++k)
    if (!context.box.periodic(k))
      refuse(type, "'tail' is for a fluid without borders; make the box periodic or leave it out");
  if (!std::isfinite(cut.whole().tail(1, D)))
    refuse(type, "the long-range correction diverges: V falls off too slowly; leave 'tail' out");
  const SpeciesPair species = species_pair(type, parameters, context.species);
  struct Sums {
    std::array<ExactSum, 2> weight;  // sum of weights for either species
    void add(const Sums& other) {
      for (int k = 0; k < 2; ++k) weight[k].add(other.weight[k]);
    }
  } sums;
  const auto* factor = pair_factors(weight, context.particles);
  for (Id i = 0; i < context.particles.mass.size(); ++i)
    for (int k = 0; k < 2; ++k)
      if (!species || context.particles.species[i] == (*species)[k]) sums.weight[k].add(factor ? (*factor)[i] : 1.0);
  if (context.ranks) sums = sum_of_all(*context.ranks, sums);
  const double pairs = sums.weight[0].value() * sums.weight[1].value();
  const bool alike = !species || (*species)[0] == (*species)[1];
  return tail_correction<D>(cut, alike ? pairs / 2 : pairs, context.box.volume());
}

/// A term cut as `options` say, with its long-range correction if requested.
template <int D, Potential P>
std::unique_ptr<Interaction<D>> cut_term(std::string_view type, P potential, PairWeight weight,
                                         const CutOptions& options, const Parameters& parameters,
                                         const InteractionContext<D>& context) {
  const Cut<P> cut(potential, options.cutoff, options.kind, options.switch_from);
  Tail correction;
  if constexpr (HasTail<P>)
    if (parameters.has("tail") && parameters.flag("tail"))
      correction = tail<D>(type, cut, options.kind, weight, parameters, context);
  return within_reach<D>(type, cut, weight, parameters, context, potential, correction);
}

/// A term cut as `cutoff` and `cut` say, or over all pairs without `cutoff`.
template <int D, Potential P>
std::unique_ptr<Interaction<D>> pair_term(std::string_view type, P potential, PairWeight weight,
                                          const Parameters& parameters, const InteractionContext<D>& context) {
  if (!parameters.has("cutoff")) {
    refuse_cut_options(type, parameters);
    return all_pairs<D>(type, potential, weight, parameters, context, "give 'cutoff'");
  }
  return cut_term<D>(type, potential, weight, cut_options(type, parameters), parameters, context);
}

}  // namespace carom::options
