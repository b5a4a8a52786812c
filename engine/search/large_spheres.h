// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Spheres that are much larger than most, beside cells for the small ones.
//
// A cell as large as the largest sphere would hold many small ones. So only small spheres are in linked cells, which
// are as large as the largest of them. A large sphere has a region instead: all cells in which a small sphere may touch
// it, while it is within `skin` of the place where the region was made. The cells are combined into blocks, and each
// block has a list of the large spheres whose regions hold it, so that a small sphere finds them in the block of its
// own cell. Two large spheres can touch only where their regions overlap; each has a list of such others.
//
// Other programs have a grid for each octave of radii (Ogarko, Luding, Comput. Phys. Commun. 183 (2012) 931). Then each
// small sphere searches the large cells around it after each collision, and a large one all small cells in them.

#include <span>
#include <vector>

#include "engine/search/linked_cells.h"
#include "engine/search/next_event.h"

namespace carom {

template <int D>
class LargeSpheres {
 public:
  /// `cells` hold the small spheres, whose reaches (Sizes) are at most `small`; all arguments must outlive this.
  LargeSpheres(const LinkedCells<D>& cells, const Packing<D>& packing, std::span<const double> reach, double small,
               double skin, PageVector<NextEvent<D>>& next_events);

  bool has(Slot i) const { return number_[i] != kSmall; }
  double skin() const { return skin_; }

  /// The large sphere is now at x: makes a new region for it, around this place.
  void renew(Slot i, const Vec<D>& x);
  /// Whether a small sphere that has moved from one cell to another finds other large spheres.
  bool parts(const CellPlace<D>& one, const CellPlace<D>& other) const {
    return block(one) != block(other) || one.boxes != other.boxes;
  }

  /// All large spheres that a small one in this place may touch, as input of the kernels; valid until the next call.
  ScanTask around(Slot i, const CellPlace<D>& place);
  /// All spheres that a large one may touch, as input of the kernels; valid until the next call.
  ScanTask around(Slot i);

 private:
  static constexpr std::uint32_t kSmall = 0xffffffff;
  /// Along each axis. Regions are made of blocks: larger ones hold more small spheres, smaller ones are more vectors.
  static constexpr int kCellsOfBlock = 2;
  static constexpr unsigned kPadding = 8;  // candidates behind the last one
  struct Large {
    Cell<D> low, high;                // of the region, in unwrapped cells
    std::vector<std::uint32_t> near;  // the other large spheres
  };

  std::size_t block(const CellPlace<D>& place) const {
    std::size_t at = 0;
    for (int k = 0; k < D; ++k) at = at * blocks_[k] + place.wrapped[k] / kCellsOfBlock;
    return at;
  }
  template <class Visit>
  void for_each_block(const Large& large, Visit&& visit) const;
  Vec<D> centre(Slot i) const { return Eigen::Map<const Vec<D>>(next_events_[i].where.centre); }
  void find(Slot i, const Image<D>& away, std::span<const std::uint32_t> listed, std::vector<std::uint32_t>& found) const;
  void check(Slot i, std::span<const std::uint32_t> found) const;
  void add(std::uint32_t candidate);
  ScanTask task(Slot i);

  const LinkedCells<D>& cells_;
  const Packing<D>& packing_;
  std::span<const double> reach_;
  double small_, skin_;
  PageVector<NextEvent<D>>& next_events_;
  std::array<std::size_t, D> blocks_;  // along each axis
  std::vector<std::uint32_t> number_;  // by slot: the index in large_, or kSmall
  std::vector<Large> large_;
  // By block: the large spheres whose regions hold it, with the box of the block as seen from the box of their centre.
  std::vector<std::vector<std::uint32_t>> listed_;
  std::int32_t widest_ = 0;  // the farthest box that a region has reached
  std::vector<std::uint32_t> found_, candidates_;
  unsigned count_ = 0, same_ = 0;
};

}  // namespace carom
