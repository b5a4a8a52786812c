#pragma once
// Which pairs a term of V is summed over: a list of bonds, all pairs, or the pairs within a cutoff.
//
// Each source offers
//   for_each(x, x_new, visit)   calls visit(i, j, shift) for its pairs in the order (i, j, image), i < j; the pair's
//                               separation is separation(x[i], x[j], shift), at x_new with the same shift
// and
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
  PairList pairs_;
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
};

}  // namespace carom
