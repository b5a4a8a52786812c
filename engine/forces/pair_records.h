// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Pairs in the layout that the kernels of pair_kernels.h read, and sums of forces in the order of the list.
//
// Particles are numbered by their place in the list, where neighbours in space are close together. The list has each
// pair once for each of its images, with the particle that comes first as the first one; the order only changes the
// sign of the separation.

#include <span>
#include <vector>

#include "engine/base/force_sums.h"
#include "engine/base/pages.h"
#include "engine/forces/simd/pair_kernels.h"
#include "engine/laws/box.h"

namespace carom {

/// The positions between which pairs are evaluated.
template <int D>
struct PairStep {
  std::span<const Vec<D>> x;
  std::span<const Vec<D>> x_new{};              ///< for mean forces; else empty
  std::span<const Vec<D>> vectors{};            ///< for Hessian products, instead of x_new; else empty
  const std::vector<double>* weight = nullptr;  ///< pairs are weighted with the product of these; null: weight 1
  const char* changed = nullptr;                ///< only pairs with a changed particle; null: all pairs
};

template <int D>
class PairRecords {
 public:
  enum Kind {
    kPlain,         ///< both particles are owned
    kMoving,        ///< both are owned, but one may be wrapped into another box
    kShared,        ///< another rank owns one of the particles, and this rank evaluates the pair
    kSharedMoving,  ///< as kShared, and one may be wrapped
    kKinds
  };
  static bool shared(Kind kind) { return kind == kShared || kind == kSharedMoving; }

  std::vector<Id> order;  ///< particles by place
  std::size_t own = 0;    ///< the number of places of own particles, which come first
  std::vector<PairRun> runs[kKinds];
  /// Places of partners, followed by at least eight more valid ones, for padding.
  std::vector<std::uint32_t, RawPageAllocator<std::uint32_t>> partners[kKinds];
  std::vector<PairRecord> box;    ///< numbers of the boxes that the particles are in; empty: all 0
  std::int32_t turns = 0;         ///< Box::turns when the images were found
  std::size_t most_partners = 0;  ///< upper bound for any particle

  /// Removes all but partners.
  void clear();
  /// Loads the positions and weights of a step, of the particles in the places from `first` to before `end`.
  void load(const PairStep<D>& step, std::size_t first, std::size_t end);
  void load(const PairStep<D>& step, std::size_t first = 0) { load(step, first, order.size()); }
  /// The input of the kernels; call load() first.
  PairRows rows(Kind kind, const Box<D>& box, const PairStep<D>& step);

  /// Sums in the order of the list: low() sets its words to zero, high() allocates its words.
  ForceWords* low();
  ForceWords* high();
  /// Adds the sums of this list to `sums`.
  void flush_to(ForceSums<D>& sums);

 private:
  std::vector<PairRecord> x_, x_new_;
  std::vector<ForceWords> low_, high_;
  std::vector<PairRun> some_runs_;  // only runs with a changed particle
  std::vector<std::uint32_t> some_partners_;
};

}  // namespace carom
