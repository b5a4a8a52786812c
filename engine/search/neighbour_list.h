// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A Verlet list: the pairs that can come within reach while no particle moves far.
//
// The list is built from a cell grid with a skin and rebuilt when a particle has moved more than half of the skin.
// Pairs are sorted by (lower id, higher id, image), so that loops over the list have the same order for any skin: a
// wider skin only adds pairs that are out of reach. A pair can occur with several images if a periodic box is small.
// (Verlet, Phys. Rev. 159 (1967) 98.)

#include <span>
#include <vector>

#include "engine/base/vec.h"
#include "engine/laws/box.h"
#include "engine/search/partners.h"
#include "engine/search/skin.h"

namespace carom {

/// A pair of particles i < j; their separation is x[i] − x[j] + shift(image).
template <int D>
struct NeighbourPair {
  Id i, j;
  Image<D> image;
  auto operator<=>(const NeighbourPair&) const = default;
};

template <int D>
class NeighbourList {
 public:
  /// Lists pairs (i, j) that can come as near as reach(i) + reach(j), except those pairs whose lower particle is marked
  /// in `without`, which must outlive the list, and pairs of two particles marked in `fixed`. Empty marks exclude none.
  NeighbourList(const Box<D>& box, std::vector<double> reach, std::span<const char> without = {},
                std::vector<char> fixed = {});

  /// The pairs that are within reach at x, at x_new, or anywhere on straight lines or shallow arcs between them (arcs
  /// that deviate from x by at most `margin` more than the straight displacement). Rebuilds the list if needed. Throws
  /// Error(Failure::numerical) for steps of several edges of a periodic box, and for far too many pairs.
  std::span<const NeighbourPair<D>> cover(std::span<const Vec<D>> x, std::span<const Vec<D>> x_new, double margin = 0);
  std::span<const NeighbourPair<D>> cover(std::span<const Vec<D>> x, double margin = 0) { return cover(x, x, margin); }

  /// Forgets the list, which was made for longer steps than those to come.
  void drop() {
    built_at_.clear();
    skin_.begin(0);
  }
  /// The partners of each particle in the pairs that cover() returned last, with the indices of the pairs.
  const Partners& partners();

  std::uint64_t rebuilds() const { return rebuilds_; }

 private:
  bool build(std::span<const Vec<D>> x);
  void follow_wrap(Id i, std::span<const Vec<D>> x, std::vector<Image<D>>& crossed);

  const Box<D>& box_;
  std::vector<double> reach_;
  std::span<const char> without_;
  std::vector<char> fixed_;
  Skin skin_;
  std::vector<Vec<D>> built_at_;  // positions at the last build, moved along when a particle is wrapped
  double built_with_tilt_ = 0;
  std::vector<NeighbourPair<D>> pairs_;
  Partners partners_;  // empty if not used since the last build
  std::uint64_t rebuilds_ = 0;
};

}  // namespace carom
