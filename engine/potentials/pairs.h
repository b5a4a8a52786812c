#pragma once
// Which pairs a term of V is summed over: a list of bonds, all pairs, or the pairs within a cutoff.
//
// Each source offers
//   for_each(x, x_new, visit)   calls visit(i, j, shift) for its pairs in the order (i, j, image), i < j; the pair's
//                               separation is separation(x[i], x[j], shift), at x_new with the same shift
// and for a slab in which nobody strays farther than `margin` from its start x
//   begin_slab(x, margin)
//   for_each_in_slab(x, visit)              as for_each
//   for_each_partner_in_slab(x, i, visit)   calls visit(j, shift, pair) for the pairs of i, in the order (j, image);
//                                           the shift is that of the pair (lower id, higher id), `pair` its place in
//                                           the loop over all
//   pairs_in_slab()                         how many these are
//   kRemembered                             whether it pays to keep what was found for a pair
//
//   reach(x), reach(share, ranks)           how far apart partners are at most; infinite: no end
//   among(some)                             itself for some of the particles, if they are enough
//
// Where ranks share a system, pairs of two ghosts are visited like any other; the loops of PairTerm pass over them.

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "engine/error.h"
#include "engine/exchange.h"
#include "engine/interaction.h"
#include "engine/neighbour_list.h"
#include "engine/partners.h"

namespace carom {

/// The shift of a pair in a box without periodic axes.
struct NoShift {};

template <int D>
Vec<D> separation(const Vec<D>& x_i, const Vec<D>& x_j, const Vec<D>& shift) {
  return x_i - x_j + shift;
}
template <int D>
Vec<D> separation(const Vec<D>& x_i, const Vec<D>& x_j, NoShift) {
  return x_i - x_j;
}

/// The two species, in either order, that a term is restricted to; or no restriction.
class SpeciesPair {
 public:
  SpeciesPair() = default;
  SpeciesPair(const std::vector<std::uint16_t>& species_of, std::uint16_t a, std::uint16_t b)
      : species_of_(&species_of), a_(a), b_(b) {}

  template <int D>
  SpeciesPair among(const Particles<D>& some) const {
    return all() ? SpeciesPair() : SpeciesPair(some.species, a_, b_);
  }
  bool all() const { return species_of_ == nullptr; }
  bool contains(Id i, Id j) const {
    if (all()) return true;
    const std::uint16_t p = (*species_of_)[i], q = (*species_of_)[j];
    return (p == a_ && q == b_) || (p == b_ && q == a_);
  }

 private:
  const std::vector<std::uint16_t>* species_of_ = nullptr;
  std::uint16_t a_ = 0, b_ = 0;
};

/// Bonds, given with i < j in ascending order. A bond spans the image that is nearest at x; one that grows to nearly
/// half an edge of a periodic box, where another image becomes the nearest, throws Error(Failure::numerical).
template <int D>
class Bonds {
 public:
  static constexpr bool kRemembered = true;
  Bonds(const Box<D>& box, PairList pairs) : box_(box), pairs_(std::move(pairs)) {}

  std::optional<Bonds> among(const Particles<D>& some) const {
    if (some.id.empty()) return *this;
    constexpr Id kNobody = std::numeric_limits<Id>::max();
    std::vector<Id> number(some.id.back() + 1, kNobody);
    for (Id i = 0; i < some.id.size(); ++i) number[some.id[i]] = i;
    const auto of = [&](Id id) { return id < number.size() ? number[id] : kNobody; };
    PairList known;
    for (const auto& [a, b] : pairs_) {
      const Id i = of(a), j = of(b);
      if (i != kNobody && j != kNobody)
        known.push_back({i, j});
      else if ((i != kNobody && some.owns(i)) || (j != kNobody && some.owns(j)))
        return std::nullopt;
    }
    return Bonds(box_, std::move(known));
  }
  double reach(Positions<D> x) const {
    double longest = 0;
    for_each(x, x, [&](Id i, Id j, const Vec<D>& shift) {
      longest = std::max(longest, separation<D>(x[i], x[j], shift).norm());
    });
    return longest;
  }
  double reach(const Particles<D>& share, Exchange& ranks) const {
    const Id first = share.size() > 0 ? share.id_of(0) : 0;
    const auto here = [&](Id id) { return id >= first && id - first < share.size(); };
    Bytes told;  // of whom another has the lower partner
    for (const auto& [i, j] : pairs_)
      if (!here(i) && here(j)) put(told, j), put(told, share.x[j - first]);
    std::unordered_map<Id, Vec<D>> elsewhere;
    for (const Bytes& each : ranks.gather(told))
      for (Reader reader(each); reader.more();) {
        const auto id = reader.get<Id>();
        elsewhere[id] = reader.get<Vec<D>>();
      }
    double longest = 0;
    for (const auto& [i, j] : pairs_) {
      if (!here(i)) continue;
      const Vec<D> d = share.x[i - first] - (here(j) ? share.x[j - first] : elsewhere.at(j));
      longest = std::max(longest, (d + box_.shift(box_.nearest_image(d))).norm());
    }
    return longest;
  }

  void begin_slab(Positions<D> x, double /*margin*/) const {
    if (partners_.empty()) partners_.build(x.size(), pairs_.size(), [&](std::size_t k) { return pairs_[k]; });
    wrapped_.clear();
    std::uint32_t pair = 0;
    for_each(x, x, [&](Id, Id, const Vec<D>& shift) {
      if (shift != Vec<D>::Zero()) wrapped_.push_back({pair, shift});
      ++pair;
    });
  }
  std::size_t pairs_in_slab() const { return pairs_.size(); }
  template <class Visit>
  void for_each_in_slab(Positions<D>, Visit&& visit) const {
    const std::size_t pairs = pairs_.size();
    std::size_t pair = 0;
    const Vec<D> none = Vec<D>::Zero();
    for (std::size_t k = 0; k <= wrapped_.size(); ++k) {
      for (const std::size_t end = k < wrapped_.size() ? wrapped_[k].pair : pairs; pair < end; ++pair)
        visit(pairs_[pair][0], pairs_[pair][1], none);
      if (pair == pairs) return;
      visit(pairs_[pair][0], pairs_[pair][1], wrapped_[k].shift);
      ++pair;
    }
  }
  template <class Visit>
  void for_each_partner_in_slab(Positions<D> x, Id i, Visit&& visit) const {
    for (const auto& [j, pair] : partners_.of(i)) {
      const auto& [lo, hi] = pairs_[pair];
      visit(j, box_.shift(box_.nearest_image(x[lo] - x[hi])), pair);
    }
  }

  template <class Visit>
  void for_each(Positions<D> x, Positions<D> /*x_new*/, Visit&& visit) const {
    for (const auto& [i, j] : pairs_) {
      const Vec<D> shift = box_.shift(box_.nearest_image(x[i] - x[j]));
      check_length(i, j, x[i] - x[j] + shift);
      visit(i, j, shift);
    }
  }

 private:
  void check_length(Id i, Id j, const Vec<D>& d) const {
    for (int k = 0; k < D; ++k)
      if (box_.periodic(k) && std::abs(d[k]) > 0.48 * box_.edges[k])
        throw Error(Failure::numerical, "the bond of particles " + std::to_string(i) + " and " + std::to_string(j) +
                                            " spans nearly half the periodic box along axis " + std::to_string(k) +
                                            ", where its image is ambiguous; use a larger box");
  }

  const Box<D>& box_;
  struct Wrapped {
    std::uint32_t pair;
    Vec<D> shift;
  };
  PairList pairs_;
  mutable Partners partners_;             // a cache
  mutable std::vector<Wrapped> wrapped_;  // the bonds of the slab that span another image, in their order
};

/// All pairs of `particles` particles, in a box without periodic axes; nothing is stored.
template <int D>
class AllPairs {
 public:
  AllPairs(std::size_t particles, SpeciesPair species) : particles_(static_cast<Id>(particles)), species_(species) {}

  std::optional<AllPairs> among(const Particles<D>& some) const {
    if (some.size() < particles_) return std::nullopt;
    return AllPairs(particles_, species_.among(some));
  }
  double reach(Positions<D>) const { return std::numeric_limits<double>::infinity(); }
  double reach(const Particles<D>&, Exchange&) const { return std::numeric_limits<double>::infinity(); }
  static constexpr bool kRemembered = false;  // who collides changes the path of everybody
  void begin_slab(Positions<D>, double) const {}
  template <class Visit>
  void for_each_in_slab(Positions<D> x, Visit&& visit) const {
    for_each(x, x, visit);
  }
  std::size_t pairs_in_slab() const { return 0; }  // of those that are remembered
  template <class Visit>
  void for_each_partner_in_slab(Positions<D>, Id i, Visit&& visit) const {
    for (Id j = 0; j < particles_; ++j)
      if (j != i && species_.contains(i, j)) visit(j, NoShift{}, 0);
  }

  template <class Visit>
  void for_each(Positions<D> /*x*/, Positions<D> /*x_new*/, Visit&& visit) const {
    for (Id i = 0; i < particles_; ++i)
      for (Id j = i + 1; j < particles_; ++j)
        if (species_.contains(i, j)) visit(i, j, NoShift{});
  }

 private:
  Id particles_;
  SpeciesPair species_;
};

/// The pairs within a cutoff, and some beyond: whoever visits them looks at the distance.
template <int D>
class PairsWithinCutoff {
 public:
  PairsWithinCutoff(const Box<D>& box, std::size_t particles, double cutoff, SpeciesPair species)
      : box_(box),
        cutoff_(cutoff),
        species_(species),
        list_(box, std::vector<double>(particles, 0.5 * cutoff), wanted(species)) {}

  std::optional<PairsWithinCutoff> among(const Particles<D>& some) const {
    return PairsWithinCutoff(box_, some.size(), cutoff_, species_.among(some));
  }
  double reach(Positions<D>) const { return cutoff_; }
  double reach(const Particles<D>&, Exchange&) const { return cutoff_; }

  template <class Visit>
  void for_each(Positions<D> x, Positions<D> x_new, Visit&& visit) const {
    for (const NeighbourPair<D>& pair : list_.cover(x, x_new)) visit(pair.i, pair.j, box_.shift(pair.image));
  }

  static constexpr bool kRemembered = true;
  void begin_slab(Positions<D> x, double margin) const { in_slab_ = list_.cover(x, margin); }
  std::size_t pairs_in_slab() const { return in_slab_.size(); }
  template <class Visit>
  void for_each_in_slab(Positions<D>, Visit&& visit) const {
    for (const NeighbourPair<D>& pair : in_slab_) visit(pair.i, pair.j, box_.shift(pair.image));
  }
  template <class Visit>
  void for_each_partner_in_slab(Positions<D>, Id i, Visit&& visit) const {
    for (const auto& [j, pair] : list_.partners().of(i)) visit(j, box_.shift(in_slab_[pair].image), pair);
  }

 private:
  static std::function<bool(Id, Id)> wanted(SpeciesPair species) {
    if (species.all()) return {};
    return [species](Id i, Id j) { return species.contains(i, j); };
  }

  const Box<D>& box_;
  double cutoff_;
  SpeciesPair species_;
  // Caches: their state never shows in the sums.
  mutable NeighbourList<D> list_;
  mutable std::span<const NeighbourPair<D>> in_slab_;
};

}  // namespace carom
