// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Neighbour lists with a skin: for each sphere all others that it could touch while both stay within `skin` of where
// they were when their lists were made. A sphere that leaves that region gets a new list, and those of its neighbours
// are updated.
//
// The centres of the regions stand in cells (region_cells.h); spheres of very different sizes have cells of their own,
// a factor of two in radius each, so that a small sphere does not look through cells as large as the largest one. Lists
// are symmetric. (Verlet, Phys. Rev. 159 (1967) 98; event-driven: Donev, Torquato, Stillinger, J. Comput. Phys. 202
// (2005) 737.)

#include <functional>
#include <span>
#include <vector>

#include "engine/base/prefetch.h"
#include "engine/search/candidate_lists.h"
#include "engine/search/next_event.h"
#include "engine/search/region_cells.h"

namespace carom {

template <int D>
class SkinLists {
 public:
  /// `radius` by slot, the largest one they will have; where all are and stay `equal`, of the first one alone. Spheres
  /// admitted later are not larger than `largest`.
  SkinLists(const Box<D>& box, const Packing<D>& packing, const ScanKernels& kernels, std::span<const double> radius,
            bool equal, double largest, double skin, PageVector<NextEvent<D>>& next_events);

  double skin() const { return skin_; }
  const std::uint32_t* candidates(const NextEvent<D>& a) const { return lists_.of(a); }

  /// Makes all lists for n spheres, with centres place(slot). find_near() will be called with `max_displacement`.
  void build(std::size_t n, const std::function<Vec<D>(Slot)>& place, const Extent<D>& extent,
             double max_displacement = 0);

  /// The sphere is now at x: makes its list anew and mends those of its neighbours. Returns what is new in it, padded
  /// like a list; good until the next call.
  std::span<const std::uint32_t> renew(Slot i, const Vec<D>& x);

  /// The spheres have moved since, and been wrapped into the box: mends images and renews the lists of those that have
  /// left their regions.
  void follow(std::span<const Record<D>> records);

  /// Takes in a sphere at x, in an empty slot; `radius` as in the constructor.
  void admit(Slot i, const Vec<D>& x, std::span<const double> radius);
  /// Removes a sphere.
  void dismiss(Slot i);
  /// The sphere is now at x: renews its list where that is farther than `room` from the centre of its region; whether
  /// it was.
  bool move(Slot i, const Vec<D>& x, double room);
  /// Starts to fetch the list of a sphere; of a long one what a list of equal spheres would be.
  void prefetch(const NextEvent<D>& a) const {
    for (const unsigned q : {0u, 16u, 32u}) prefetch_line(candidates(a) + q);
  }
  /// All spheres that a sphere may touch where both have come up to `max_displacement` from their regions.
  std::span<const std::uint32_t> find_near(Slot i, double max_displacement);

 private:
  struct Level {  // spheres of similar size
    double largest_radius;
    RegionCells<D> cells;
  };

  static std::uint8_t octave(double largest, double radius);
  std::size_t level_of(Slot i) const { return equal_ ? 0 : level_[i]; }
  Vec<D> centre(Slot i) const {
    Vec<D> c;
    for (int k = 0; k < D; ++k) c[k] = next_events_[i].where.centre[k];
    return c;
  }
  double radius(Slot i) const { return radius_[equal_ ? 0 : i]; }
  void insert(Slot i, const Vec<D>& x);
  void remove(Slot i) { levels_[level_of(i)].cells.remove(i, centre(i)); }
  void widen(std::int32_t boxes);
  std::span<const std::uint32_t> surround(Slot i, const Vec<D>& x, double max_displacement = 0);
  void look_into(Level& level, Slot i, const Vec<D>& x, double max_displacement, unsigned& found);
  void shift(Slot i, const Image<D>& boxes);

  Box<D> box_;
  Packing<D> packing_;
  const ScanKernels& kernels_;
  std::span<const double> radius_;
  bool equal_;
  double largest_, skin_;
  PageVector<NextEvent<D>>& next_events_;
  CandidateLists<D> lists_;
  std::vector<Level> levels_;
  std::vector<std::uint8_t> level_;  // by slot; empty where all are equal
  PageVector<std::int32_t> boxes_;   // by slot: the box of the region's centre, as a linear image

  std::vector<std::uint32_t> found_, fresh_;
  std::vector<std::uint64_t> kept_;
  std::int32_t widest_ = 0;  // boxes: the farthest that a sphere has come, or can see
  bool exact_ = false;       // rounded places do not suffice: distances are computed
};

}  // namespace carom
