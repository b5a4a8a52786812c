// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Neighbour lists with a skin: each list holds all spheres that a sphere can touch while both stay within `skin` of
// their positions at the time when their lists were made. A sphere that leaves this region gets a new list, and the
// lists of its neighbours are updated.
//
// The centres of the regions are stored in cells (region_cells.h); each factor of two in reach has separate cells, so
// that a small sphere does not search cells as large as the largest sphere. Lists are symmetric. (Verlet, Phys. Rev.
// 159 (1967) 98; event-driven: Donev, Torquato, Stillinger, J. Comput. Phys. 202 (2005) 737.)
//
// In a sheared box the regions move with the flow. All positions are then coordinates of flow_frame.h, in which regions
// stand still; lists hold the spheres that are near at any strain of the frame.

#include <functional>
#include <span>
#include <vector>

#include "engine/base/prefetch.h"
#include "engine/search/candidate_lists.h"
#include "engine/search/flow_frame.h"
#include "engine/search/next_event.h"
#include "engine/search/region_cells.h"

namespace carom {

template <int D>
class SkinLists {
 public:
  /// `reach`, by slot, is the largest reach (Sizes) that a sphere will have; if all are and stay `equal`, only the
  /// first is used. Spheres admitted later have reaches of at most `largest`. The tilt of `box` is that at the time of
  /// the frame.
  SkinLists(const Box<D>& box, const FlowFrame& flow, const Packing<D>& packing, const ScanKernels& kernels,
            std::span<const double> reach, bool equal, double largest, double skin,
            PageVector<NextEvent<D>>& next_events);

  /// The octave of sizes to which a sphere belongs, 0 for the largest ones, kOctaves − 1 for all smaller ones and
  /// points.
  static std::uint8_t octave(double largest, double reach);
  static constexpr int kOctaves = 31;

  double skin() const { return skin_; }
  const FlowFrame& flow() const { return flow_; }
  /// Lists made from now on need not hold before this time, nor, if windows are repaired, before this much less strain.
  void pass(double now, double strain) {
    const double back = flow_.rate > 0 ? strain : -strain, from = flow_.strain(now) - back;
    if (std::abs(flow_.to - from) < std::abs(flow_.to - flow_.from)) flow_.from = from;
  }
  const std::uint32_t* candidates(const NextEvent<D>& a) const { return lists_.of(a); }

  /// Makes all lists for n spheres with centres place(slot). `max_displacement` is the largest that find_near() will
  /// get.
  void build(std::size_t n, const std::function<Vec<D>(Slot)>& place, const Extent<D>& extent,
             double max_displacement = 0);

  /// The sphere is now at x: makes a new list for it and updates the lists of its neighbours. Returns the new
  /// candidates, padded like a list; valid until the next call.
  std::span<const std::uint32_t> renew(Slot i, const Vec<D>& x);

  /// The spheres have moved and have been wrapped into the box: updates the images, and renews the lists of spheres
  /// that have left their regions.
  void follow(std::span<const Record<D>> records);

  /// Adds a sphere at x in an empty slot; `reach` as in the constructor.
  void admit(Slot i, const Vec<D>& x, std::span<const double> reach);
  /// Removes a sphere.
  void dismiss(Slot i);
  /// The sphere is now at x: renews its list if it is farther than `room` from the centre of its region; returns
  /// whether it was.
  bool move(Slot i, const Vec<D>& x, double room, double now);
  /// Starts to fetch the list of a sphere, at most as far as a typical list of equal spheres extends.
  void prefetch(const NextEvent<D>& a) const {
    for (const unsigned q : {0u, 16u, 32u}) prefetch_line(candidates(a) + q);
  }
  /// All spheres that a sphere may touch if both are up to `max_displacement` outside their regions.
  std::span<const std::uint32_t> find_near(Slot i, double max_displacement);

 private:
  struct Level {  // spheres of similar size
    double largest_reach;
    RegionCells<D> cells;
  };

  std::size_t level_of(Slot i) const { return equal_ ? 0 : level_[i]; }
  Vec<D> centre(Slot i) const {
    Vec<D> c;
    for (int k = 0; k < D; ++k) c[k] = next_events_[i].where.centre[k];
    return c;
  }
  double reach(Slot i) const { return reach_[equal_ ? 0 : i]; }
  void insert(Slot i, const Vec<D>& x);
  void remove(Slot i) { levels_[level_of(i)].cells.remove(i, centre(i)); }
  void widen(std::int32_t boxes);
  std::span<const std::uint32_t> surround(Slot i, const Vec<D>& x, double max_displacement = 0);
  void look_into(Level& level, Slot i, const Vec<D>& x, double max_displacement, unsigned& found);
  void shift(Slot i, const Image<D>& boxes);

  Box<D> box_;
  FlowFrame flow_;
  Packing<D> packing_;
  const ScanKernels& kernels_;
  std::span<const double> reach_;
  bool equal_;
  double largest_, skin_;
  PageVector<NextEvent<D>>& next_events_;
  CandidateLists<D> lists_;
  std::vector<Level> levels_;
  std::vector<std::uint8_t> level_;  // by slot; empty if all reaches are equal
  PageVector<std::int32_t> boxes_;   // by slot: the box of the region's centre, as a linear image

  std::vector<std::uint32_t> found_, fresh_;
  std::vector<std::uint64_t> kept_;
  std::int32_t widest_ = 0;  // the largest number of boxes that a sphere has moved, or can see
  bool exact_ = false;       // rounded positions do not suffice: distances are computed
};

}  // namespace carom
