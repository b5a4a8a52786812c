// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// All pairs within a cutoff plus a skin: a Verlet list (Phys. Rev. 159 (1967) 98), built from cells.

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "engine/base/particles.h"
#include "engine/forces/pair_filter.h"
#include "engine/forces/pair_records.h"
#include "engine/laws/box.h"
#include "engine/search/skin.h"

namespace carom {

template <int D>
class CutoffList {
 public:
  /// `like`: a list from which to take the first skin width, or null.
  CutoffList(const Box<D>& box, double cutoff, PairFilter filter, const CutoffList* like = nullptr)
      : box_(box), cutoff_(cutoff), skin_(0.1 * cutoff, 16, 0.8 * cutoff), filter_(std::move(filter)) {
    if (like) shared_width_ = like->shared_width_;
  }

  /// The pairs within the cutoff at x or x_new, and some beyond. A pair keeps the image it has at x. `particles` has
  /// ghosts and ids. `own_covered`: cover_own() has just returned a list for the own particles at x, and before_build()
  /// is called if a new list must replace it. Throws Error(Failure::numerical) if positions are not finite, or for
  /// steps of several periodic boxes or with far too many pairs.
  PairRecords<D>& cover(const PairStep<D>& step, const Particles<D>& particles, bool own_covered = false,
                        const std::function<void()>& before_build = {});
  /// The pairs of own particles at x, where the positions of ghosts are unknown; null if a new list is needed for them,
  /// or if there are no ghosts.
  PairRecords<D>* cover_own(const PairStep<D>& step, const Particles<D>& particles);

  /// The particles are others than those of the last cover().
  void forget() { made_ = false; }
  /// Whether a new list will be needed in the next step if particles move on as in the last one.
  bool ages() const { return made_ && farthest_ + grown_ > 0.5 * skin_.width(); }
  /// The next cover() makes a new list.
  void renew() { renew_ = true; }
  /// As Interaction::add_listed_pairs().
  void add_listed_pairs(std::span<std::uint32_t> of_particle) const;

  void use(const PairKernels& kernels) { kernels_ = &kernels; }

 private:
  bool is_for(const PairStep<D>& step, const Particles<D>& particles) const {
    return made_ && particles_ == step.x.size() && ghost_ == particles.ghost;
  }
  /// The tilt in the lattice of the last build, where it was in the box.
  double tilt_since_build() const { return box_.tilt + (box_.turns - records_.turns) * box_.edges[0]; }
  /// The strain since the last build, and in a step over which mean forces are computed.
  double strain() const { return (tilt_since_build() - built_with_tilt_) / box_.edges[1]; }
  double strain_of(const PairStep<D>& step) const {
    return step.x_new.empty() ? 0 : (box_.next_tilt - box_.tilt) / box_.edges[1];
  }
  double lost_to(double strain) const;
  bool follow(const PairStep<D>& step, std::size_t first, std::size_t end, double& squared_from_build,
              double& squared_step);
  void build(const PairStep<D>& step, const Particles<D>& particles);
  void find_pairs(std::uint32_t row, std::span<const struct PartnerRange> ranges);

  const Box<D>& box_;
  double cutoff_;
  Skin skin_;
  std::shared_ptr<double> shared_width_ = std::make_shared<double>(0);  // skin width, common to lists made like this
  PairFilter filter_;
  const PairKernels* kernels_ = &widest_kernels<PairKernels>();
  std::vector<char> ghost_;
  std::size_t particles_ = 0;  // at the last build
  bool made_ = false, renew_ = false;
  double farthest_ = 0, grown_ = 0;  // the largest displacement at the last cover(), and how much it had grown
  PairRecords<D> records_;           // own particles before ghosts
  double own_squared_ = 0;           // the largest squared displacement found by cover_own()
  double built_with_tilt_ = 0;
  std::array<std::vector<double>, 3> built_at_;  // coordinates in the box at the last build
  std::vector<std::uint64_t> code_;
  std::vector<Id> id_;  // by place; empty if there are no ghosts
  std::vector<std::uint32_t> other_;
  std::array<std::size_t, 2> sizes_{};  // numbers of partners in kPlain and in kShared; the arrays are longer
  struct Rows {
    std::size_t done, all;
  } own_rows_{}, ghost_rows_{};  // of a build: particles that have looked for partners
};

}  // namespace carom
