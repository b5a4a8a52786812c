// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// How the box is divided among subdomains: by recursive bisection, so that each has about as much work.
//
// Which subdomain owns a sphere never reaches the physics; all that matters is that all ranks compute the same cuts:
// they come from sums of whole numbers, whichever rank has which spheres.

#include <algorithm>
#include <limits>
#include <span>
#include <vector>

#include "engine/base/box.h"
#include "engine/ranks/communicator.h"

namespace carom {

template <int D>
class Bisection {
 public:
  /// Subdomains for the spheres of all ranks, of which this one has those at x; so that each has about as much `work`,
  /// of each sphere (empty: the same). Places that are nearer to a subdomain than `reach` concern it. Collective; the
  /// cuts do not depend on which rank has which spheres.
  Bisection(const Box<D>& box, std::span<const Vec<D>> x, std::size_t subdomains, double reach, Communicator& ranks,
            std::span<const std::uint32_t> work = {});

  std::size_t subdomains() const { return parts_.size(); }
  double reach() const { return reach_; }
  /// The subdomains that are nearer than the reach to a subdomain, without itself.
  std::span<const std::uint32_t> neighbours(std::uint32_t subdomain) const { return neighbours_[subdomain]; }

  /// A place as it is in the box. The others take such.
  Vec<D> wrapped(Vec<D> x) const {
    Image<D> ignored{};
    box_.wrap(x, ignored);
    return x;
  }
  /// The subdomain that a place belongs to.
  std::uint32_t owner(const Vec<D>& at) const;
  /// Calls visit(subdomain) for all subdomains that a place concerns, its own first.
  template <class Visit>
  void for_each_near(const Vec<D>& at, Visit&& visit) const {
    const std::uint32_t own = owner(at);
    visit(own);
    if (deep(depth(own, at))) return;
    for (const std::uint32_t r : neighbours_[own])
      if (near(r, at)) visit(r);
  }
  /// Whether a place concerns a subdomain.
  bool near(std::uint32_t subdomain, const Vec<D>& at) const {
    return squared_distance(subdomain, at) <= reach_ * reach_;
  }
  /// Whether a place is so deep in a subdomain that it concerns no other, however distances are rounded.
  bool deep(double depth) const { return depth > (1 + 1e-6) * reach_; }
  /// Of a place from a subdomain.
  double squared_distance(std::uint32_t subdomain, const Vec<D>& at) const {
    const Part& part = parts_[subdomain];
    double sum = 0;
    for (int k = 0; k < D; ++k) {
      double d = 0;
      if (box_.periodic(k)) {
        const double away = std::abs(at[k] - part.centre[k]);
        d = std::max(std::min(away, box_.edges[k] - away) - part.half[k], 0.0);
      } else {
        d = std::max({part.low[k] - at[k], at[k] - part.high[k], 0.0});
      }
      sum += d * d;
    }
    return sum;
  }
  /// Cuts what lies between two corners down to places up to `margin` from a subdomain; false: nothing is left.
  bool clip(std::uint32_t subdomain, double margin, Vec<D>& low, Vec<D>& high) const;
  /// How far a place in a subdomain is from its faces; infinite where it has none. Negative: it is not in it.
  double depth(std::uint32_t subdomain, const Vec<D>& at) const {
    const Part& part = parts_[subdomain];
    double least = std::numeric_limits<double>::infinity();
    for (int k = 0; k < D; ++k)
      if (!part.whole[k]) least = std::min({least, at[k] - part.low[k], part.high[k] - at[k]});
    return least;
  }

 private:
  struct Part {
    Vec<D> low = Vec<D>::Zero(), high = Vec<D>::Zero();     // infinite where the box has a wall or an open end
    Vec<D> centre = Vec<D>::Zero(), half = Vec<D>::Zero();  // along periodic axes
    std::array<bool, D> whole{};                            // has no faces along the axis
  };
  struct Cut {
    int axis;
    double at;
    std::int32_t below, above;  // a further cut, or ~subdomain
  };

  struct Sphere;
  struct Piece;
  static constexpr std::int32_t kNoCut = -1;

  void settle(Piece piece, std::vector<Piece>& pieces);
  std::vector<Piece> cut(std::span<const Piece> pieces, Communicator& ranks);
  double gap(int axis, double low, double high, double other_low, double other_high) const;
  std::vector<std::uint32_t> neighbours_of(std::uint32_t subdomain) const;

  Box<D> box_;
  double reach_;
  std::vector<Part> parts_;
  std::vector<Cut> cuts_;
  std::vector<std::vector<std::uint32_t>> neighbours_;
  std::int32_t root_ = 0;
};

}  // namespace carom
