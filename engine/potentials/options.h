#pragma once
// What the types of interaction have in common in a deck: shared parameters, and how they are read.
//
// All functions throw Error(Failure::deck) whose message begins with the type's name and says what to do.

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "engine/interaction.h"
#include "engine/neighbour_list.h"
#include "engine/potentials/cut.h"
#include "engine/potentials/pair_term.h"
#include "engine/vicinity.h"

namespace carom::options {

/// Shared declarations.
Parameter species();
Parameter cutoff();
Parameter cut();

/// `own` followed by species, cutoff and cut.
std::vector<Parameter> with_pair_options(std::vector<Parameter> own);

[[noreturn]] void refuse(std::string_view type, const std::string& problem);

/// The two species `species` names, as indices into `known`; empty if the key is absent.
std::vector<std::uint16_t> species_pair(std::string_view type, const Parameters& parameters,
                                        const std::vector<std::string>& known);

/// The bonds that `pairs` or `chain` describe among so many particles, i < j, ascending; none for `within`.
PairList bonds(std::string_view type, const Parameters& parameters, std::size_t particles);

/// What ranks have found together, ascending. Collective.
PairList union_of_all(Exchange& ranks, const PairList& mine);

/// The bonds that `pairs`, `chain` or `within` describe, by ids, i < j, ascending: all there are, on each rank.
template <int D>
PairList bonds(std::string_view type, const Parameters& parameters, const InteractionContext<D>& context) {
  PairList list = bonds(type, parameters, context.total);
  if (!parameters.has("within") || !context.placed) return list;
  const double distance = parameters.real("within");
  const auto add = [&](const auto& p, auto&& counts) {
    NeighbourList<D> near(context.box, std::vector<double>(p.x.size(), 0.5 * distance));
    for (const auto& [i, j, image] : near.cover(p.x)) {
      if (!counts(i) || !((p.x[i] - p.x[j] + context.box.shift(image)).norm() <= distance)) continue;
      const PairList::value_type bond{p.id.empty() ? i : p.id[i], p.id.empty() ? j : p.id[j]};
      if (list.empty() || list.back() != bond) list.push_back(bond);  // not through another image
    }
  };
  if (context.ranks) {
    const Vicinity<D> near = vicinity(context.box, distance, *context.ranks, context.particles);
    add(near, [&](Id i) { return near.beyond[i] == 0; });
    list = union_of_all(*context.ranks, list);
  } else {
    add(context.particles, [](Id) { return true; });
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

template <int D>
SpeciesRule species_rule(std::string_view type, const Parameters& parameters, const InteractionContext<D>& context) {
  const auto pair = species_pair(type, parameters, context.species);
  return pair.empty() ? SpeciesRule() : SpeciesRule{&context.particles.species, pair[0], pair[1]};
}

template <int D>
bool any_periodic(const Box<D>& box) {
  for (int k = 0; k < D; ++k)
    if (box.periodic(k)) return true;
  return false;
}

/// A term over the pairs of a source, with the scale of the potential before it was cut.
template <int D, Potential P, class Pairs>
std::unique_ptr<Interaction<D>> term(P potential, PairWeight weight, const InteractionContext<D>& context, Pairs pairs,
                                     const auto& whole) {
  return std::make_unique<PairTerm<D, P, Pairs>>(context.particles, potential, weight, std::move(pairs),
                                                 [whole](double distance) { return whole.scale(distance); });
}

/// A term over all pairs; `remedy` says what to write instead in a periodic box, where there is no such sum.
template <int D, Potential P>
std::unique_ptr<Interaction<D>> all_pairs(std::string_view type, P potential, PairWeight weight,
                                          const Parameters& parameters, const InteractionContext<D>& context,
                                          const std::string& remedy) {
  const SpeciesRule species = species_rule(type, parameters, context);
  if (any_periodic(context.box)) refuse(type, "acts between all pairs, which a periodic box does not allow; " + remedy);
  return term<D>(potential, weight, context, AllPairs<D>(context.box, context.total, species), potential);
}

/// A term over the pairs within the reach of a potential that ends by itself.
template <int D, ShortRanged P>
std::unique_ptr<Interaction<D>> within_reach(std::string_view type, P potential, PairWeight weight,
                                             const Parameters& parameters, const InteractionContext<D>& context,
                                             const auto& whole) {
  const double reach = std::sqrt(potential.cutoff_squared()) * (1 + 1e-15);
  return term<D>(potential, weight, context,
                 PairsWithinCutoff<D>(context.box, reach, species_rule(type, parameters, context)), whole);
}

/// A term cut as `cutoff` and `cut` say; over all pairs if `cutoff` is absent.
template <int D, Potential P>
std::unique_ptr<Interaction<D>> pair_term(std::string_view type, P potential, PairWeight weight,
                                          const Parameters& parameters, const InteractionContext<D>& context) {
  if (!parameters.has("cutoff"))
    return all_pairs<D>(type, potential, weight, parameters, context, "give 'cutoff', at most half the shortest edge");
  const CutKind kind = parameters.text("cut") == "shifted" ? CutKind::shifted : CutKind::smooth;
  return within_reach<D>(type, Cut<P>(potential, parameters.real("cutoff"), kind), weight, parameters, context,
                         potential);
}

}  // namespace carom::options
