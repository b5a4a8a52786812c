// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The pairs on which a term of V acts: a filter by species and by bonds.

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "engine/base/parameters.h"
#include "engine/base/particles.h"
#include "engine/forces/simd/pair_kernels.h"
#include "engine/laws/steps.h"

namespace carom {

/// The bonds of a system, by ids.
class BondTable {
 public:
  explicit BondTable(PairList bonds) {
    for (auto& [i, j] : bonds)
      if (i > j) std::swap(i, j);
    std::ranges::sort(bonds);
    bonds.erase(std::unique(bonds.begin(), bonds.end()), bonds.end());
    for (const auto& [i, j] : bonds) {
      first_.resize(i + 2, partners_.size());
      partners_.push_back(j);
      first_.back() = partners_.size();
    }
  }
  /// Each bond once, i < j, ascending.
  PairList list() const {
    PairList bonds;
    for (Id i = 0; i + 1 < first_.size(); ++i)
      for (std::size_t n = first_[i]; n < first_[i + 1]; ++n) bonds.push_back({i, partners_[n]});
    return bonds;
  }
  bool joins(Id i, Id j) const {
    if (i > j) std::swap(i, j);
    if (i + 1 >= first_.size()) return false;
    const auto partners = std::span(partners_).subspan(first_[i], first_[i + 1] - first_[i]);
    return std::ranges::find(partners, j) != partners.end();
  }

 private:
  std::vector<std::size_t> first_;  ///< start of each particle's bonded partners with higher ids
  std::vector<Id> partners_;
};

/// The bonds of these terms and of steps; null if none has bonds.
template <class Terms>
std::shared_ptr<const BondTable> bonds_of(const Terms& terms, const Steps& steps) {
  PairList all;
  bool any = steps.bonds() > 0;
  steps.for_each_bond([&](Id i, Id j, const PairSteps&) { all.push_back({i, j}); });
  for (const auto& term : terms)
    if (const PairList* bonds = term ? term->bonds() : nullptr) {
      all.insert(all.end(), bonds->begin(), bonds->end());
      any = true;
    }
  return any ? std::make_shared<BondTable>(std::move(all)) : nullptr;
}

/// Two species in either order; empty: all species.
using SpeciesPair = std::optional<std::array<std::uint16_t, 2>>;

/// Selects pairs of one particle of each species; a = b: pairs within one species.
struct SpeciesRule {
  const std::vector<std::uint16_t>* species_of = nullptr;  ///< null: all pairs
  std::uint16_t a = 0, b = 0;

  bool all() const { return species_of == nullptr; }
  /// Whether the particles of a pair have two species.
  bool apart() const { return !all() && a != b; }
  /// The code of a particle in a PartnerSearch. The code of a partner must have one of the bits of partner_code().
  std::uint64_t code(Id i) const {
    if (all()) return PartnerSearch::kFirst;
    const std::uint16_t s = (*species_of)[i];
    return (s == a ? PartnerSearch::kFirst : 0u) | (s == b ? PartnerSearch::kSecond : 0u);
  }
  std::uint64_t partner_code(std::uint64_t code) const {
    if (all()) return PartnerSearch::kFirst;
    return ((code & PartnerSearch::kFirst) != 0 ? PartnerSearch::kSecond : 0u) |
           ((code & PartnerSearch::kSecond) != 0 ? PartnerSearch::kFirst : 0u);
  }
  /// Whether a particle and its own images are such a pair.
  bool takes_images_of(Id i) const { return (code(i) & partner_code(code(i))) != 0; }
};

/// The pairs on which a term acts. The particles it refers to must outlive it.
struct PairFilter {
  SpeciesRule species;
  std::shared_ptr<const BondTable> excluded;  ///< bonded pairs are excluded; null: no exclusions
  const std::vector<Id>* id = nullptr;        ///< ids of the particles, if there are exclusions

  /// The filter for other particles.
  template <int D>
  PairFilter among(const Particles<D>& some) const {
    PairFilter other = *this;
    if (!species.all()) other.species.species_of = &some.species;
    other.id = &some.id;
    return other;
  }
  bool excludes(Id i, Id j) const {
    return excluded && excluded->joins(id->empty() ? i : (*id)[i], id->empty() ? j : (*id)[j]);
  }
};

}  // namespace carom
