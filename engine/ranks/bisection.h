// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Divides the box into subdomains of about equal work by recursive bisection.
//
// The owner of a sphere never affects the results; but all ranks must compute the same cuts, so the cuts come from sums
// of integers and do not depend on which rank has which spheres.

#include <algorithm>
#include <limits>
#include <span>
#include <vector>

#include "engine/laws/box.h"
#include "engine/ranks/communicator.h"

namespace carom {

template <int D>
class Bisection {
 public:
  /// Divides the spheres of all ranks; this rank has the spheres at x. `work`: of each sphere (empty: all equal). A
  /// position is near a subdomain if its distance is at most `reach`, that of a pair of the largest spheres, which have
  /// the reach (Sizes) `largest`. Collective; the cuts do not depend on which rank has which spheres.
  Bisection(const Box<D>& box, std::span<const Vec<D>> x, std::size_t subdomains, double reach, Communicator& ranks,
            std::span<const std::uint32_t> work = {}, double largest = 0);

  std::size_t subdomains() const { return parts_.size(); }
  double reach() const { return reach_; }
  /// The distance from a subdomain at which a sphere with this reach can touch a largest sphere of the subdomain.
  double reach_of(double sphere) const { return reach_ - (largest_ - sphere); }
  /// The other subdomains within reach of a subdomain.
  std::span<const std::uint32_t> neighbours(std::uint32_t subdomain) const { return neighbours_[subdomain]; }

  /// The position wrapped into the box, as all other functions require.
  Vec<D> wrapped(Vec<D> x) const {
    Image<D> ignored{};
    box_.wrap(x, ignored);
    return x;
  }
  /// The subdomain that contains a position.
  std::uint32_t owner(const Vec<D>& at) const;
  /// Calls visit(subdomain) for all subdomains near a position, the one that contains it first.
  template <class Visit>
  void for_each_near(const Vec<D>& at, Visit&& visit) const {
    for_each_near(at, reach_, visit);
  }
  /// for_each_near() with `reach` for "near", which is at most reach().
  template <class Visit>
  void for_each_near(const Vec<D>& at, double reach, Visit&& visit) const {
    const std::uint32_t own = owner(at);
    visit(own);
    if (deep(depth(own, at), reach)) return;
    for (const std::uint32_t r : neighbours_[own])
      if (near(r, at, reach)) visit(r);
  }
  enum class Side { above, below, unknown };
  /// Whether this position in subdomain `other`, if it is within reach of a position in `subdomain`, is above or below
  /// that one. Of two positions within reach of each other, one is above the other as seen from either subdomain, or it
  /// is unknown to both. The axis is the first periodic one that separates the subdomains and is so long that no
  /// position in one of them is within reach of two images of a position in the other.
  Side side(std::uint32_t subdomain, std::uint32_t other, const Vec<D>& at) const;
  /// Whether a position is near a subdomain.
  bool near(std::uint32_t subdomain, const Vec<D>& at) const { return near(subdomain, at, reach_); }
  bool near(std::uint32_t subdomain, const Vec<D>& at, double reach) const {
    return squared_distance(subdomain, at) <= reach * reach;
  }
  /// Whether a position with this depth is farther than `reach` from every other subdomain, allowing for rounding.
  static bool deep(double depth, double reach) { return depth > (1 + 1e-6) * reach; }
  /// The squared distance of a position from a subdomain.
  double squared_distance(std::uint32_t subdomain, const Vec<D>& at) const {
    return squared_distance(parts_[subdomain], parts_[subdomain].half, at, at, at);
  }
  /// A displacement without its parts along axes that no cut crosses: distances from subdomains do not depend on them.
  Vec<D> across_cuts(const Vec<D>& way) const { return way.cwiseProduct(cut_axes_); }
  /// Reduces the box between two corners to the positions within `margin` of a subdomain; false if none is left.
  bool clip(std::uint32_t subdomain, double margin, Vec<D>& low, Vec<D>& high) const;
  /// The distance of a position in a subdomain from its faces; infinite if there are none, negative outside.
  double depth(std::uint32_t subdomain, const Vec<D>& at) const {
    const Part& part = parts_[subdomain];
    double least = std::numeric_limits<double>::infinity();
    for (int k = 0; k < D; ++k)
      if (!part.whole[k]) least = std::min({least, at[k] - part.low[k], part.high[k] - at[k]});
    return least;
  }

 private:
  struct Part {
    Vec<D> low = Vec<D>::Zero(), high = Vec<D>::Zero();     // infinite at a wall or an open end of the box
    Vec<D> centre = Vec<D>::Zero(), half = Vec<D>::Zero();  // along periodic axes
    std::array<bool, D> whole{};                            // axes along which it has no faces
  };
  struct Cut {
    int axis;
    double at;
    std::int32_t below, above;  // index of another cut, or ~subdomain
  };

  struct Sphere;
  struct Piece;
  static constexpr std::int32_t kNoCut = -1;

  void attach(Piece piece, std::vector<Piece>& pieces);
  std::vector<Piece> cut(std::span<const Piece> pieces, Communicator& ranks);
  /// The squared distance of a part from the box between two corners; `half`: the sum of their half edges, used along
  /// periodic axes like the centre.
  double squared_distance(const Part& part, const Vec<D>& half, const Vec<D>& centre, const Vec<D>& low,
                          const Vec<D>& high) const {
    double sum = 0;
    for (int k = 0; k < D; ++k) {
      double d = 0;
      if (box_.periodic(k)) {
        const double away = std::abs(centre[k] - part.centre[k]);
        d = std::max(std::min(away, box_.edges[k] - away) - half[k], 0.0);
      } else {
        d = std::max({part.low[k] - high[k], low[k] - part.high[k], 0.0});
      }
      sum += d * d;
    }
    return sum;
  }
  std::vector<std::uint32_t> neighbours_of(std::uint32_t subdomain) const;

  Box<D> box_;
  double reach_, largest_;
  std::vector<Part> parts_;
  std::vector<Cut> cuts_;
  std::vector<std::vector<std::uint32_t>> neighbours_;
  std::int32_t root_ = 0;
  Vec<D> cut_axes_ = Vec<D>::Zero();  // 1 along axes that cuts cross
};

}  // namespace carom
