// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A Verlet list: the pairs that come within reach while no particle moves far.
//
// The list is built from a cell grid with a skin and rebuilt when a particle has moved more than half of it. Pairs are
// held in the order (lower id, higher id, image), so that loops over the list go in id order whatever the skin: a
// wider list only adds pairs that are out of reach. A pair may stand there with several images where a periodic box is
// small. (Verlet, Phys. Rev. 159 (1967) 98.)

#include <span>
#include <vector>

#include "engine/base/box.h"
#include "engine/base/vec.h"
#include "engine/search/partners.h"
#include "engine/search/skin.h"

namespace carom {

/// Particles i < j; x[i] − x[j] + shift(image) is the pair's separation.
template <int D>
struct NeighbourPair {
  Id i, j;
  Image<D> image;
  auto operator<=>(const NeighbourPair&) const = default;
};

template <int D>
class NeighbourList {
 public:
  /// Lists pairs (i, j) that can come as near as reach(i) + reach(j). `without`: not those with a lower particle that
  /// is marked there; it outlives the list, and empty: all.
  NeighbourList(const Box<D>& box, std::vector<double> reach, std::span<const char> without = {});

  /// The pairs that are within reach at x, at x_new, or anywhere on straight lines or shallow arcs between them
  /// (arcs that deviate no farther from x than `margin` besides the straight displacement). Rebuilds where
  /// needed. Throws Error(Failure::numerical) for steps of several edges of a periodic box, and with far too many
  /// pairs.
  std::span<const NeighbourPair<D>> cover(std::span<const Vec<D>> x, std::span<const Vec<D>> x_new, double margin = 0);
  std::span<const NeighbourPair<D>> cover(std::span<const Vec<D>> x, double margin = 0) { return cover(x, x, margin); }

  /// For each particle its partners among the pairs that cover() gave last, and where they stand there.
  const Partners& partners();

  std::uint64_t rebuilds() const { return rebuilds_; }

 private:
  bool build(std::span<const Vec<D>> x);
  void follow_wrap(Id i, std::span<const Vec<D>> x, std::vector<Image<D>>& crossed);

  const Box<D>& box_;
  std::vector<double> reach_;
  std::span<const char> without_;
  Skin skin_;
  std::vector<Vec<D>> built_at_;  // positions at the last build, moved along when a particle is wrapped
  std::vector<NeighbourPair<D>> pairs_;
  Partners partners_;  // empty: not used since the last build
  std::uint64_t rebuilds_ = 0;
};

}  // namespace carom
