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
#include "engine/potentials/pair_filter.h"

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

/// Bonds, given with i < j in ascending order. A bond spans the image that is nearest at x; one that grows to nearly
/// half an edge of a periodic box, where another image becomes the nearest, throws Error(Failure::numerical).
template <int D>
class Bonds {
 public:
  Bonds(const Box<D>& box, PairList pairs) : box_(box), pairs_(std::move(pairs)) {}
  const PairList& list() const { return pairs_; }

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
  AllPairs(std::size_t particles, PairFilter filter)
      : particles_(static_cast<Id>(particles)), filter_(std::move(filter)) {}

  std::optional<AllPairs> among(const Particles<D>& some) const {
    if (some.size() < particles_) return std::nullopt;
    return AllPairs(particles_, filter_.among(some));
  }
  double reach(Positions<D>) const { return std::numeric_limits<double>::infinity(); }
  double reach(const Particles<D>&, Exchange&) const { return std::numeric_limits<double>::infinity(); }
  template <class Visit>
  void for_each(Positions<D> /*x*/, Positions<D> /*x_new*/, Visit&& visit) const {
    for (Id i = 0; i < particles_; ++i)
      for (Id j = i + 1; j < particles_; ++j)
        if (filter_.contains(i, j)) visit(i, j, NoShift{});
  }

 private:
  Id particles_;
  PairFilter filter_;
};

/// The pairs within a cutoff, and some beyond: whoever visits them looks at the distance.
template <int D>
class PairsWithinCutoff {
 public:
  PairsWithinCutoff(const Box<D>& box, std::size_t particles, double cutoff, PairFilter filter)
      : box_(box),
        cutoff_(cutoff),
        filter_(std::move(filter)),
        list_(box, std::vector<double>(particles, 0.5 * cutoff), wanted(filter_)) {}

  std::optional<PairsWithinCutoff> among(const Particles<D>& some) const {
    return PairsWithinCutoff(box_, some.size(), cutoff_, filter_.among(some));
  }
  double reach(Positions<D>) const { return cutoff_; }
  double reach(const Particles<D>&, Exchange&) const { return cutoff_; }

  template <class Visit>
  void for_each(Positions<D> x, Positions<D> x_new, Visit&& visit) const {
    for (const NeighbourPair<D>& pair : list_.cover(x, x_new)) visit(pair.i, pair.j, box_.shift(pair.image));
  }

 private:
  static std::function<bool(Id, Id)> wanted(const PairFilter& filter) {
    if (filter.all()) return {};
    return [filter](Id i, Id j) { return filter.contains(i, j); };
  }

  const Box<D>& box_;
  double cutoff_;
  PairFilter filter_;
  // Caches: their state never shows in the sums.
  mutable NeighbourList<D> list_;
};

}  // namespace carom
