#pragma once
// Which pairs a term of V leaves out: those of other species, and those joined by a bond.

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "engine/parameters.h"
#include "engine/particles.h"

namespace carom {

/// The bonds of a system, by ids.
class BondTable {
 public:
  explicit BondTable(PairList bonds) {
    for (auto& [i, j] : bonds)
      if (i > j) std::swap(i, j);
    std::ranges::sort(bonds);
    for (const auto& [i, j] : bonds) {
      first_.resize(i + 2, partners_.size());
      partners_.push_back(j);
      first_.back() = partners_.size();
    }
  }
  bool joins(Id i, Id j) const {
    if (i > j) std::swap(i, j);
    if (i + 1 >= first_.size()) return false;
    const auto partners = std::span(partners_).subspan(first_[i], first_[i + 1] - first_[i]);
    return std::ranges::find(partners, j) != partners.end();
  }

 private:
  std::vector<std::size_t> first_;  ///< where the higher partners of each particle begin
  std::vector<Id> partners_;
};

/// The bonds that these terms stand for; null: none of them does.
template <class Terms>
std::shared_ptr<const BondTable> bonds_of(const Terms& terms) {
  PairList all;
  bool any = false;
  for (const auto& term : terms)
    if (const PairList* bonds = term ? term->bonds() : nullptr) {
      all.insert(all.end(), bonds->begin(), bonds->end());
      any = true;
    }
  return any ? std::make_shared<BondTable>(std::move(all)) : nullptr;
}

/// Two species, in either order; or no restriction.
using SpeciesPair = std::optional<std::array<std::uint16_t, 2>>;

class PairFilter {
 public:
  /// All pairs.
  PairFilter() = default;
  /// The pairs of these species that `excluded` does not join (null: none). The particles outlive the filter.
  template <int D>
  PairFilter(const Particles<D>& particles, SpeciesPair species, std::shared_ptr<const BondTable> excluded)
      : species_of_(&particles.species), id_(&particles.id), species_(species), excluded_(std::move(excluded)) {}

  template <int D>
  PairFilter among(const Particles<D>& some) const {
    return PairFilter(some, species_, excluded_);
  }
  bool all() const { return !species_ && !excluded_; }
  /// Particles by their numbers here.
  bool contains(Id i, Id j) const {
    if (species_) {
      const std::array pair = {(*species_of_)[i], (*species_of_)[j]};
      if (pair != *species_ && std::array{pair[1], pair[0]} != *species_) return false;
    }
    return !excluded_ || !excluded_->joins(id_->empty() ? i : (*id_)[i], id_->empty() ? j : (*id_)[j]);
  }

 private:
  const std::vector<std::uint16_t>* species_of_ = nullptr;
  const std::vector<Id>* id_ = nullptr;
  SpeciesPair species_;
  std::shared_ptr<const BondTable> excluded_;
};

}  // namespace carom
