// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Pairs in the form that the kernels of pair_kernels.h read, and the sums of forces in the order of the list.
//
// Particles are numbered by their place in the list, those that are near each other close together. A pair stands once
// in the list for each of its images, with whichever particle comes first there: its separation only changes sign.

#include <span>
#include <vector>

#include "engine/base/box.h"
#include "engine/base/force_sums.h"
#include "engine/forces/simd/pair_kernels.h"

namespace carom {

/// The positions between which pairs are evaluated.
template <int D>
struct PairStep {
  std::span<const Vec<D>> x;
  std::span<const Vec<D>> x_new{};              ///< of mean forces; else empty
  std::span<const Vec<D>> vectors{};            ///< of Hessian products, in place of new positions
  const std::vector<double>* weight = nullptr;  ///< pairs count by the product of these; null: as they are
  const char* changed = nullptr;                ///< only pairs with such a particle; null: all
};

template <int D>
class PairRecords {
 public:
  enum Kind {
    kPlain,   ///< both are owned
    kMoving,  ///< so too, but one may be carried round the box
    kShared,  ///< another rank owns one of them
    kKinds
  };

  std::vector<Id> order;  ///< particles by place
  std::vector<PairRun> runs[kKinds];
  std::vector<std::uint32_t> partners[kKinds];  ///< and eight more
  std::vector<PairRecord> box;                  ///< numbers of the boxes that particles are in; empty: 0
  std::size_t most_partners = 0;                ///< of a particle, or more

  void clear();
  /// Takes the positions and weights of a step.
  void load(const PairStep<D>& step);
  /// What kernels are to read; after load().
  PairRows rows(Kind kind, const Box<D>& box, const PairStep<D>& step);

  /// Sums in the order of the list: low() begins them at zero, high() has them where there is need of them.
  ForceWords* low();
  ForceWords* high();
  /// Moves the sums to those of all terms.
  void pass_on(ForceSums<D>& sums);

 private:
  std::vector<PairRecord> x_, x_new_;
  std::vector<ForceWords> low_, high_;
  std::vector<PairRun> some_runs_;  // with a changed particle
  std::vector<std::uint32_t> some_partners_;
};

}  // namespace carom
