#pragma once
// Lists of pairs in the form that the kernels of pair_kernels.h read, and the sums of forces in the order of the list.
//
// Particles are numbered by their place in the list, those that are near each other close together. A pair stands once
// in the list for each of its images, with whichever particle comes first there: its separation only changes sign.

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "engine/base/box.h"
#include "engine/base/force_sums.h"
#include "engine/base/particles.h"
#include "engine/forces/pair_filter.h"
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

/// All pairs within a cutoff, and some beyond: a Verlet list (Phys. Rev. 159 (1967) 98) with a skin, made from cells.
template <int D>
class CutoffList {
 public:
  /// `like`: a list with a skin that is good to begin with; null: there is none.
  CutoffList(const Box<D>& box, double cutoff, PairFilter filter, const CutoffList* like = nullptr)
      : box_(box), cutoff_(cutoff), filter_(std::move(filter)) {
    if (like) learned_ = like->learned_;
  }

  /// The pairs that are within the cutoff at x or x_new. A pair keeps the image it has at x. `particles` gives ghosts
  /// and ids. Throws Error(Failure::numerical) for positions that are not finite, and for steps of several edges of a
  /// periodic box or with far too many pairs.
  PairRecords<D>& cover(const PairStep<D>& step, const Particles<D>& particles);

  void use(const PairKernels& kernels) { kernels_ = &kernels; }

 private:
  static constexpr double kLeastSkin = 0.1;  // [cutoff]

  bool follow(const PairStep<D>& step, double& squared_from_build, double& squared_step);
  void build(const PairStep<D>& step, const Particles<D>& particles);
  void find_pairs(std::uint32_t row, std::span<const struct PartnerRange> ranges);

  const Box<D>& box_;
  double cutoff_, skin_ = 0;
  std::shared_ptr<double> learned_ = std::make_shared<double>(0);  // the last skin of this list and those made like it
  PairFilter filter_;
  const PairKernels* kernels_ = &pair_kernels();
  std::vector<char> ghost_;
  std::size_t particles_ = 0;  // at the last build
  std::uint64_t calls_ = 0, rebuilds_ = 0;
  PairRecords<D> records_;
  std::array<std::vector<double>, 3> built_at_;  // coordinates in the box at the last build
  std::vector<std::uint64_t> code_;
  std::vector<std::uint32_t> plain_, other_;
  std::size_t plain_size_ = 0;
};

}  // namespace carom
