// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Sources of pairs for the sum of a term of V: a list of bonds, all pairs, or the pairs within a cutoff.
// The concept PairSource states what every source must offer. ListedPairs adds what a source with a list of pairs
// offers, PairsWithImages what a source offers if a particle can interact with its own images.

#include <algorithm>
#include <cmath>
#include <concepts>
#include <functional>
#include <limits>
#include <numeric>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "engine/base/error.h"
#include "engine/forces/pair_list.h"
#include "engine/laws/interaction.h"
#include "engine/ranks/communicator.h"

namespace carom {

template <class S, int D>
concept PairSource = requires(const S& source, S& changing, Positions<D> x, const PairStep<D>& step, ForceSums<D>& sums,
                              const Particles<D>& particles, Communicator& ranks, PairBatch& batch, void (*visit)(),
                              const PairKernels& kernels) {
  // Fills the batch repeatedly and calls visit(): with pairs of own particles, and with the pairs with a ghost that
  // this rank evaluates.
  source.batches(step, particles, 1.0, batch, visit);
  { source.id(0u) } -> std::same_as<Id>;                    // the particle with this number in a batch
  source.low(sums), source.high(sums);                      // words to which the forces of a batch are added
  source.flush_to(sums);                                    // comes after all forces
  { source.most_partners() } -> std::same_as<std::size_t>;  // upper bound for any particle in these batches
  changing.use(kernels);                                    // replaces the widest kernels of this machine
  // The largest distance of partners; infinite: unlimited.
  { source.reach(x) } -> std::same_as<double>;
  { source.reach(particles, ranks) } -> std::same_as<double>;
  { source.among(particles) } -> std::same_as<std::optional<S>>;  // for a subset; nothing if partners are missing
};

/// A source with a list of pairs, which ages.
template <class S, int D>
concept ListedPairs = PairSource<S, D> &&
    requires(const S& source, S& changing, const PairStep<D>& step, const Particles<D>& particles, PairBatch& batch,
             void (*visit)(), std::function<void()> before_new, std::span<std::uint32_t> of_particle) {
  // As batches() for pairs of own particles, where the positions of ghosts are unknown; false if that is impossible.
  { source.own_batches(step, particles, 1.0, batch, visit) } -> std::same_as<bool>;
  // The rest of the pairs; before_new() is called if sums must be flushed before new batches.
  source.rest_batches(step, particles, 1.0, batch, visit, before_new);
  { source.ages() } -> std::same_as<bool>;  // this and the next two as in Interaction
  source.renew();
  source.add_listed_pairs(of_particle);
  changing.regroup();  // the particles have been replaced by others
};

/// A source in which a particle can interact with its own images.
template <class S, int D>
concept PairsWithImages = PairSource<S, D> && requires(const S& source, void (*visit)(const Vec<D>&)) {
  source.for_each_own_image(visit);  // the separations of any particle from its own images within reach, one of ±d
  { source.takes_images_of(Id{}) } -> std::same_as<bool>;  // whether a particle and its images are pairs of this source
};

/// Fills the batch from each part of a list in turn, from the kinds of pairs of own particles, shared ones, or both.
template <int D, class Visit>
void collect_batches(PairRecords<D>& records, const Box<D>& box, const PairStep<D>& step, double cutoff_squared,
                     const PairKernels& kernels, PairBatch& batch, Visit&& visit, bool own = true, bool shared = true) {
  using Records = PairRecords<D>;
  for (const auto kind : {Records::kPlain, Records::kMoving, Records::kShared, Records::kSharedMoving}) {
    if (!(Records::shared(kind) ? shared : own)) continue;
    PairRows rows = records.rows(kind, box, step);
    rows.cutoff_squared = cutoff_squared;
    for (PairCursor cursor; kernels.collect(rows, cursor, batch);) visit();
  }
}

/// Bonds, given with i < j in ascending order. A bond uses the nearest image at x. A bond of nearly half an edge of a
/// periodic box, beyond which another image is the nearest, throws Error(Failure::numerical).
template <int D>
class Bonds {
 public:
  Bonds(const Box<D>& box, PairList pairs) : box_(box), pairs_(std::move(pairs)) {
    std::unordered_map<Id, std::size_t> partners;
    for (const auto& pair : pairs_)
      for (const Id i : pair) most_partners_ = std::max(most_partners_, ++partners[i]);
  }

  bool sheared() const { return box_.sheared(); }
  bool knows_shear() const { return true; }
  const PairList& list() const { return pairs_; }

  std::optional<Bonds> among(const Particles<D>& some) const {
    if (some.id.empty()) return *this;
    constexpr Id kUnknown = std::numeric_limits<Id>::max();
    std::vector<Id> number(some.id.back() + 1, kUnknown);
    for (Id i = 0; i < some.id.size(); ++i) number[some.id[i]] = i;
    const auto of = [&](Id id) { return id < number.size() ? number[id] : kUnknown; };
    PairList known;
    for (const auto& [a, b] : pairs_) {
      const Id i = of(a), j = of(b);
      if (!(i != kUnknown && some.owns(i)) && !(j != kUnknown && some.owns(j))) continue;
      if (i == kUnknown || j == kUnknown) return std::nullopt;
      known.push_back({i, j});
    }
    Bonds bonds(box_, std::move(known));
    bonds.ids_ = some.id;
    return bonds;
  }
  double reach(Positions<D> x) const {
    double longest = 0;
    for (const auto& [i, j] : pairs_) longest = std::max(longest, (x[i] - x[j] + box_.shift(image_of(i, j, x))).norm());
    return longest;
  }
  double reach(const Particles<D>& block, Communicator& ranks) const {
    const Id first = block.size() > 0 ? block.id_of(0) : 0;
    const auto here = [&](Id id) { return id >= first && id - first < block.size(); };
    std::vector<std::pair<Id, Vec<D>>> higher;  // upper partners of bonds, if the lower one is on another rank
    for (const auto& [i, j] : pairs_)
      if (!here(i) && here(j)) higher.emplace_back(j, block.x[j - first]);
    std::unordered_map<Id, Vec<D>> elsewhere;
    for (const auto& [id, x] : gather_values<std::pair<Id, Vec<D>>>(ranks, higher)) elsewhere[id] = x;
    double longest = 0;
    for (const auto& [i, j] : pairs_) {
      if (!here(i)) continue;
      const Vec<D> d = block.x[i - first] - (here(j) ? block.x[j - first] : elsewhere.at(j));
      longest = std::max(longest, (d + box_.shift(box_.nearest_image(d))).norm());
    }
    return longest;
  }

  template <class Visit>
  void batches(const PairStep<D>& step, const Particles<D>& particles, double /*cutoff_squared*/, PairBatch& batch,
               Visit&& visit) const {
    batch.clear();
    const auto flush = [&] {
      batch.pad();
      if (batch.n > 0) visit();
      batch.clear();
    };
    for (const auto& [i, j] : pairs_) {
      if (step.changed && step.changed[i] == 0 && step.changed[j] == 0) continue;
      if (!particles.evaluates(i, j)) continue;
      const Image<D> image = image_of(i, j, step.x);
      const Vec<D> d = step.x[i] - step.x[j] + box_.shift(image);
      batch.begin_row(i);
      for (int k = 0; k < 3; ++k) batch.d[k][batch.n] = k < D ? d[k] : 0;
      if (!step.x_new.empty() || !step.vectors.empty()) {
        const Vec<D> d_new = step.vectors.empty() ? Vec<D>(step.x_new[i] - step.x_new[j] + box_.next_shift(image))
                                                  : Vec<D>(step.vectors[i] - step.vectors[j]);
        for (int k = 0; k < 3; ++k) batch.d_new[k][batch.n] = k < D ? d_new[k] : 0;
      }
      batch.above[batch.n] = image[1];
      batch.weight[batch.n] = step.weight ? (*step.weight)[i] * (*step.weight)[j] : 1;
      batch.second[batch.n++] = j;
      if (batch.n == PairBatch::kCapacity) flush();
    }
    flush();
  }
  Id id(std::uint32_t place) const { return place; }
  ForceWords* low(ForceSums<D>& sums) const { return sums.low(); }
  ForceWords* high(ForceSums<D>& sums) const { return sums.high(); }
  void flush_to(ForceSums<D>&) const {}
  std::size_t most_partners() const { return most_partners_; }
  void use(const PairKernels&) {}

 private:
  /// The image in which the bond is at x.
  Image<D> image_of(Id i, Id j, Positions<D> x) const {
    const Vec<D> straight = x[i] - x[j];
    if ((straight.array().abs() <= kMaxBondLength * box_.edges.array()).all()) return {};
    const Image<D> image = box_.nearest_image(straight);
    const Vec<D> shift = box_.shift(image);
    for (int k = 0; k < D; ++k)
      if (box_.periodic(k) && std::abs(straight[k] + shift[k]) > kMaxBondLength * box_.edges[k])
        throw Error(Failure::numerical, "the bond of particles " + std::to_string(ids_.empty() ? i : ids_[i]) +
                                            " and " + std::to_string(ids_.empty() ? j : ids_[j]) +
                                            " spans nearly half the periodic box along axis " + std::to_string(k) +
                                            ", where its image is ambiguous; use a larger box");
    return image;
  }

  static constexpr double kMaxBondLength = 0.48;  // longest bond along a periodic axis [edge]

  const Box<D>& box_;
  PairList pairs_;
  std::span<const Id> ids_;  // the particles' global ids; empty: pairs_ has them
  std::size_t most_partners_ = 0;
};

/// All pairs of `particles` particles in a box without periodic axes. They are not stored: the partners of a particle
/// are in few runs, sorted by species if necessary, by ownership, and by the rule of Particles::evaluates().
template <int D>
class AllPairs {
 public:
  AllPairs(const Box<D>& box, std::size_t particles, PairFilter filter)
      : box_(box), particles_(particles), filter_(std::move(filter)) {}

  bool sheared() const { return false; }
  bool knows_shear() const { return false; }
  std::optional<AllPairs> among(const Particles<D>& some) const {
    if (some.size() < particles_) return std::nullopt;
    return AllPairs(box_, particles_, filter_.among(some));
  }
  double reach(Positions<D>) const { return std::numeric_limits<double>::infinity(); }
  double reach(const Particles<D>&, Communicator&) const { return std::numeric_limits<double>::infinity(); }

  template <class Visit>
  void batches(const PairStep<D>& step, const Particles<D>& particles, double cutoff_squared, PairBatch& batch,
               Visit&& visit) const {
    if (records_.order.empty() || ghost_ != particles.ghost) arrange(particles);
    need_finite(particles, step.x);
    records_.load(step);
    collect_batches(records_, box_, step, cutoff_squared, *kernels_, batch, visit);
  }
  Id id(std::uint32_t place) const { return records_.order[place]; }
  ForceWords* low(ForceSums<D>&) const { return records_.low(); }
  ForceWords* high(ForceSums<D>&) const { return records_.high(); }
  void flush_to(ForceSums<D>& sums) const { records_.flush_to(sums); }
  std::size_t most_partners() const { return particles_; }
  void use(const PairKernels& kernels) { kernels_ = &kernels; }

 private:
  void arrange(const Particles<D>& particles) const {
    ghost_ = particles.ghost;
    records_.clear();
    std::vector<std::uint32_t> end;  // ends of groups: by species, then own particles before ghosts
    const bool apart = filter_.species.apart();
    for (const std::uint64_t code : {PartnerSearch::kFirst, PartnerSearch::kSecond})
      for (const bool owned : {true, false}) {
        for (const Id odd : {0u, 1u})
          for (Id i = 0; i < particles_; ++i)
            if (particles.owns(i) == owned && particles.id_of(i) % 2 == odd && (filter_.species.code(i) & code) != 0 &&
                (apart || code == PartnerSearch::kFirst))
              records_.order.push_back(i);
        end.push_back(static_cast<std::uint32_t>(records_.order.size()));
      }
    records_.own = records_.order.size();
    const auto add = [&](auto kind, std::uint32_t row, std::uint32_t first, std::uint32_t last) {
      const auto run = [&](std::uint32_t stop) {
        if (first < stop) records_.runs[kind].push_back({row, first, stop - first, {0, 0, 0}});
      };
      const Id i = records_.order[row];
      const bool shared = PairRecords<D>::shared(kind);
      for (std::uint32_t r = first; (filter_.excluded || shared) && r < last; ++r)
        if (const Id j = records_.order[r];
            (shared && !particles.evaluates(i, j)) || (filter_.excluded && filter_.excludes(i, j)))
          run(r), first = r + 1;
      run(last);
    };
    for (std::uint32_t row = 0; row < end[1]; ++row) {
      const bool owned = row < end[0];
      const std::uint32_t own = apart ? end[1] : owned ? row + 1 : end[1], owned_end = apart ? end[2] : end[0];
      add(owned ? PairRecords<D>::kPlain : PairRecords<D>::kShared, row, own, owned_end);
      if (owned) add(PairRecords<D>::kShared, row, owned_end, apart ? end[3] : end[1]);
    }
    for (const auto kind : {PairRecords<D>::kPlain, PairRecords<D>::kShared}) {
      auto& partners = records_.partners[kind];
      partners.assign(records_.order.size() + 8, 0u);
      std::iota(partners.begin(), partners.end() - 8, 0u);
    }
  }

  const Box<D>& box_;
  std::size_t particles_;
  PairFilter filter_;
  const PairKernels* kernels_ = &widest_kernels<PairKernels>();
  // Caches, which do not affect the sums.
  mutable PairRecords<D> records_;
  mutable std::vector<char> ghost_;
};

template <int D>
class PairsWithinCutoff {
 public:
  PairsWithinCutoff(const Box<D>& box, double cutoff, PairFilter filter, const CutoffList<D>* like = nullptr)
      : box_(box), cutoff_(cutoff), filter_(filter), list_(box, cutoff, std::move(filter), like) {}

  bool sheared() const { return box_.sheared(); }
  /// Own images, which slide relative to each other, are not known.
  bool knows_shear() const {
    for (int k = 0; k < D; ++k)
      if (box_.periodic(k) && !(cutoff_ < box_.edges[k])) return false;
    return true;
  }
  std::optional<PairsWithinCutoff> among(const Particles<D>& some) const {
    return PairsWithinCutoff(box_, cutoff_, filter_.among(some), &list_);
  }
  double reach(Positions<D>) const { return cutoff_; }
  double reach(const Particles<D>&, Communicator&) const { return cutoff_; }

  /// Throws Error(Failure::numerical) if there are too many.
  template <class Visit>
  void for_each_own_image(Visit&& visit) const {
    constexpr double kMostOwnImages = 1e8;
    std::array<int, 3> last{};
    double all = 1;
    for (int k = 0; k < D; ++k) {
      if (!box_.periodic(k)) continue;
      const double boxes = std::floor(cutoff_ / box_.edges[k]);
      all *= 2 * boxes + 1;
      last[k] = static_cast<int>(std::min(boxes, kMostOwnImages));
    }
    if (all > kMostOwnImages)
      throw Error(Failure::numerical, "too many of a particle's own images are within the cutoff of " +
                                          short_text(cutoff_) + "; use a shorter cutoff");
    Image<D> image{};
    for (int a = 0; a <= last[0]; ++a)
      for (int b = a > 0 ? -last[1] : 0; b <= last[1]; ++b)
        for (int c = a > 0 || b > 0 ? -last[2] : 1; c <= last[2]; ++c) {
          image[0] = a, image[1] = b;
          if constexpr (D == 3) image[2] = c;
          visit(box_.shift(image));
        }
  }
  bool takes_images_of(Id i) const { return filter_.species.takes_images_of(i); }

  template <class Visit>
  void batches(const PairStep<D>& step, const Particles<D>& particles, double cutoff_squared, PairBatch& batch,
               Visit&& visit) const {
    records_ = &list_.cover(step, particles);
    collect_batches(*records_, box_, step, cutoff_squared, *kernels_, batch, visit);
  }
  template <class Visit>
  bool own_batches(const PairStep<D>& step, const Particles<D>& particles, double cutoff_squared, PairBatch& batch,
                   Visit&& visit) const {
    records_ = list_.cover_own(step, particles);
    if (records_) collect_batches(*records_, box_, step, cutoff_squared, *kernels_, batch, visit, true, false);
    return records_ != nullptr;
  }
  template <class Visit>
  void rest_batches(const PairStep<D>& step, const Particles<D>& particles, double cutoff_squared, PairBatch& batch,
                    Visit&& visit, const std::function<void()>& before_new) const {
    records_ = &list_.cover(step, particles, true, before_new);
    collect_batches(*records_, box_, step, cutoff_squared, *kernels_, batch, visit, false);
  }
  void regroup() { list_.forget(); }
  bool ages() const { return list_.ages(); }
  void renew() const { list_.renew(); }
  void add_listed_pairs(std::span<std::uint32_t> of_particle) const { list_.add_listed_pairs(of_particle); }
  Id id(std::uint32_t place) const { return records_->order[place]; }
  ForceWords* low(ForceSums<D>&) const { return records_->low(); }
  ForceWords* high(ForceSums<D>&) const { return records_->high(); }
  void flush_to(ForceSums<D>& sums) const { records_->flush_to(sums); }
  std::size_t most_partners() const { return records_->most_partners; }
  void use(const PairKernels& kernels) {
    kernels_ = &kernels;
    list_.use(kernels);
  }

 private:
  const Box<D>& box_;
  double cutoff_;
  PairFilter filter_;
  const PairKernels* kernels_ = &widest_kernels<PairKernels>();
  // Caches, which do not affect the sums.
  mutable CutoffList<D> list_;
  mutable PairRecords<D>* records_ = nullptr;
};

static_assert(PairSource<Bonds<3>, 3> && !ListedPairs<Bonds<3>, 3>);
static_assert(PairSource<AllPairs<3>, 3> && !ListedPairs<AllPairs<3>, 3>);
static_assert(ListedPairs<PairsWithinCutoff<3>, 3> && PairsWithImages<PairsWithinCutoff<3>, 3>);

}  // namespace carom
