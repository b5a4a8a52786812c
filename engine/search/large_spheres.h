// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Spheres that are much larger than most, beside cells for the small ones.
//
// A cell as large as the largest sphere would hold many small ones. So only small spheres are in linked cells, which
// are as large as the largest of them. The cells are combined into blocks. A large sphere has a region instead of a
// cell: all blocks in which a small sphere may touch it, while it is within `skin` of the place where the region was
// made. It has a list of the small spheres in its region, and each block has a list of the large spheres with
// regions that hold it. When a small sphere moves into another block, it finds the large spheres that are new there,
// and the lists of large spheres are corrected. Two large spheres can touch only where their regions overlap; each is
// then on the list of the other.
//
// Other programs have a grid for each octave of radii (Ogarko, Luding, Comput. Phys. Commun. 183 (2012) 931). Then each
// small sphere searches the large cells around it after each collision, and a large one all small cells in them.

#include <algorithm>
#include <span>
#include <vector>

#include "engine/search/linked_cells.h"
#include "engine/search/next_event.h"

namespace carom {

template <int D>
class LargeSpheres {
 public:
  /// `cells` hold the small spheres, those with reaches (Sizes) of at most `small`; all arguments must outlive this,
  /// `reach` until admit() gets another one.
  LargeSpheres(const LinkedCells<D>& cells, const Packing<D>& packing, std::span<const double> reach, double small,
               double skin, PageVector<NextEvent<D>>& next_events);

  bool has(Slot i) const { return number_[i] != kSmall; }
  double skin() const { return skin_; }

  /// The large sphere is now at x: makes a new region for it, around this place. All small spheres must be in the
  /// cells.
  void renew(Slot i, const Vec<D>& x);
  /// Whether a small sphere that has moved from one cell to another is in another block.
  bool parts(const CellPlace<D>& one, const CellPlace<D>& other) const {
    return block(one) != block(other) || one.boxes != other.boxes;
  }
  /// A small sphere has moved from one block to another: corrects the lists. Returns the large spheres that it finds
  /// there, as input of the kernels; valid until the next call.
  ScanTask pass(Slot i, const CellPlace<D>& from, const CellPlace<D>& to);

  /// A slot gets a sphere; `reach` as in the constructor. Call renew() for a large one, enter() for a small one.
  void admit(Slot i, std::span<const double> reach);
  /// Removes a large sphere.
  void dismiss(Slot i);
  /// A small sphere appears in a place, or disappears there: corrects the lists of the large ones.
  void enter(Slot i, const CellPlace<D>& place);
  void leave(Slot i, const CellPlace<D>& place);

  /// The distance from the centre of its region within which a large sphere may touch a small one, or meets the region
  /// of another large one.
  double range(Slot i) const { return (reach_[i] + std::max(small_, 0.0) + skin_) * (1 + 1e-9); }
  Vec<D> centre(Slot i) const { return Eigen::Map<const Vec<D>>(next_events_[i].where.centre); }
  /// Appends all large spheres with regions that meet the cells between two unwrapped cells, as LinkedCells sees small
  /// ones there.
  void find_between(Cell<D> low, Cell<D> high, std::vector<std::uint32_t>& found) const;

  /// All large spheres that a small one in this place may touch, as input of the kernels; valid until the next call.
  ScanTask around(Slot i, const CellPlace<D>& place);
  /// All spheres that a large one may touch, as input of the kernels; valid until the next call.
  ScanTask around(Slot i) { return large_[number_[i]].list.task(i, packing_.pack(i, 0)); }

 private:
  static constexpr std::uint32_t kSmall = 0xffffffff;
  static constexpr std::uint32_t kDismissed = 0xfffffffe;  // it was large, so its slot has no cell
  /// Along each axis. With larger blocks regions hold more small spheres, with smaller ones there are more lists.
  static constexpr int kCellsOfBlock = 2;

  /// Candidates, first those in the same box.
  class List {
   public:
    void clear() { count_ = same_ = 0; }
    std::span<const std::uint32_t> all() const { return {entries_.data(), count_}; }
    void add(std::uint32_t candidate, bool same) {
      if (entries_.size() < count_ + kPadding + 1) entries_.resize(std::size_t{2} * (count_ + kPadding + 1));
      entries_[count_] = candidate;
      if (same) std::swap(entries_[count_], entries_[same_++]);
      ++count_;
    }
    void drop(std::uint32_t candidate) {
      unsigned at = 0;
      while (entries_[at] != candidate) ++at;
      if (at < same_) {
        entries_[at] = entries_[--same_];
        at = same_;
      }
      entries_[at] = entries_[--count_];
    }
    /// For sphere i, which is `self` as a candidate in its own box.
    ScanTask task(Slot i, std::uint32_t self) {
      if (entries_.empty()) entries_.resize(kPadding);
      std::fill_n(entries_.begin() + count_, kPadding, self);
      return {i, entries_.data(), count_, same_};
    }

   private:
    static constexpr unsigned kPadding = 8;
    std::vector<std::uint32_t> entries_;
    unsigned count_ = 0, same_ = 0;
  };

  struct Large {
    Cell<D> low, high;  // of the blocks that may belong to the region, in unwrapped cells
    List list;
  };

  std::size_t block(const CellPlace<D>& place) const {
    std::size_t at = 0;
    for (int k = 0; k < D; ++k) at = at * blocks_[k] + place.wrapped[k] / kCellsOfBlock;
    return at;
  }
  const std::vector<std::uint32_t>& listed(const CellPlace<D>& place) const { return lists_[list_of_[block(place)]]; }
  template <class Visit>
  void for_each_block(const Cell<D>& low, const Cell<D>& high, const Vec<D>& x, double limit, Visit&& visit) const;
  template <class Visit>
  void for_each_block(Slot i, Visit&& visit) const;
  void clear(Slot i);
  std::uint32_t seen(std::uint32_t listed, const CellPlace<D>& place) const;
  void add(List& list, std::uint32_t candidate) const { list.add(candidate, packing_.linear(candidate) == 0); }
  void meet(Slot i, const Image<D>& away, std::span<const std::uint32_t> listed);

  const LinkedCells<D>& cells_;
  const Packing<D>& packing_;
  std::span<const double> reach_;
  double small_, skin_;  // small_ < 0: all spheres are large
  PageVector<NextEvent<D>>& next_events_;
  std::array<std::size_t, D> blocks_;  // along each axis
  std::vector<std::uint32_t> number_;  // by slot: the index in large_, kSmall or kDismissed
  std::vector<Large> large_;
  std::vector<std::uint32_t> unused_;  // indices in large_
  // The large spheres with regions that hold a block, and the box of the block as seen from the box of their centre.
  // Most blocks are in no region: theirs is the first list, which is empty.
  std::vector<std::uint32_t> list_of_;  // by block
  std::vector<std::vector<std::uint32_t>> lists_{1};
  std::vector<std::uint32_t> unused_lists_;
  std::int32_t widest_ = 0;  // the farthest box that a region has reached
  std::vector<std::uint32_t> found_;
  List around_;
};

}  // namespace carom
