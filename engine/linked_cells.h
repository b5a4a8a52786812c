#pragma once
// Who is in which cell, for dilute systems: cells as small as a diameter, most of them empty, with a list through the
// spheres of each. A sphere that crosses into another cell looks at the new ones around it.

#include <cstring>

#include "engine/agenda.h"
#include "engine/pages.h"
#include "engine/scan.h"

namespace carom {

/// The candidates that a search found, padded with the sphere itself to a multiple of 8.
struct Candidates {
  std::vector<std::uint32_t> packed = std::vector<std::uint32_t>(64);
  unsigned count = 0;
  bool shifted = false;  ///< some lie in another box
};

template <int D>
class LinkedCells {
 public:
  using Place = CellPlace<D>;

  /// Cells of edge at least `smallest`.
  LinkedCells(const Box<D>& box, const Packing<D>& packing, double smallest, std::span<const Vec<D>> x)
      : packing_(packing),
        grid_(box, smallest, x, kCellsAParticle),
        first_(grid_.cells(), kNobody),
        link_(x.size()),
        boxes_(x.size()),
        here_(packing.pack(0, 0)) {
    stride_[D - 1] = 1;
    for (int k = D - 1; k > 0; --k) stride_[k - 1] = stride_[k] * grid_.count(k);
    for (int k = 0; k < D; ++k) {
      one_[k] = 1 << (packing.field_bits * k);
      for (std::int32_t c = -1; c <= grid_.count(k); ++c) {
        typename CellGrid<D>::Step step{0, 0};
        grid_.step(k, c, step);
        steps_[k].push_back({static_cast<std::ptrdiff_t>(step.offset), shifted(step.boxes * one_[k])});
      }
      periodic_[k] = box.periodic(k);
    }
  }

  const CellGrid<D>& grid() const { return grid_; }

  /// The cell of a place in the box.
  Place place(const Vec<D>& x) const {
    Place place{};
    const Cell<D> cell = grid_.cell(x);
    const Image<D> boxes = grid_.boxes(cell);
    for (int k = 0; k < D; ++k) {
      place.unwrapped[k] = cell[k];
      place.wrapped[k] = static_cast<std::uint16_t>(cell[k] - boxes[k] * grid_.count(k));
    }
    place.boxes = packing_.linear(boxes);
    return place;
  }

  /// Fetches the cells around a place into the cache.
  void prefetch(const Place& place) const {
    const Step* const x = &steps_[0][place.wrapped[0] + 1];
    const Step* const y = &steps_[1][place.wrapped[1] + 1];
    const std::uint32_t* const first = first_.data() + (D == 3 ? place.wrapped[D - 1] : 0);
    for (int a = -1; a <= 1; ++a)
      for (int b = D == 3 ? -1 : 0; b <= (D == 3 ? 1 : 0); ++b) __builtin_prefetch(first + x[a].offset + y[b].offset);
  }

  void insert(Slot i, const Place& place) {
    std::uint32_t& first = first_[index(place)];
    link_[i] = first;
    boxes_[i] = place.boxes;
    first = packing_.pack(i, place.boxes) | (first != kNobody ? kMore : 0);
  }
  void remove(Slot i, const Place& place) {
    std::uint32_t *at = &first_[index(place)], *before = nullptr;
    while (packing_.slot(*at) != i) {
      before = at;
      at = &link_[packing_.slot(*at)];
    }
    *at = link_[i];
    if (before && *at == kNobody) *before &= ~kMore;
  }

  /// Moves a sphere into the next cell along an axis.
  void cross(Slot i, Place& place, int axis, int step) {
    remove(i, place);
    place.unwrapped[axis] += step;
    const int to = place.wrapped[axis] + step, count = grid_.count(axis);
    if (to >= 0 && to < count) {
      place.wrapped[axis] = static_cast<std::uint16_t>(to);
    } else {  // round the periodic box
      place.wrapped[axis] = static_cast<std::uint16_t>(to < 0 ? count - 1 : 0);
      const std::int32_t boxes = packing_.image(packing_.pack(0, place.boxes))[axis] + step;
      if (std::abs(boxes) > packing_.largest()) throw_too_far();
      widest_ = std::max(widest_, std::abs(boxes));
      place.boxes += step * one_[axis];
    }
    insert(i, place);
  }

  /// Everybody in the sphere's cell and those around it, itself among them.
  void around(Slot self, const Place& place, Candidates& found) {
    if (whole(place)) return heads<true, -1>(self, place, 0, 0, found);
    heads<false, -1>(self, place, 0, 0, found);
  }

  /// Everybody in the cells that came into view when the sphere crossed along an axis.
  void ahead(Slot self, const Place& place, int axis, int step, Candidates& found) {
    if (whole(place)) {
      if (axis == 0) return heads<true, 0>(self, place, 0, step, found);
      if (axis == 1) return heads<true, 1>(self, place, 1, step, found);
      if constexpr (D == 3) return heads<true, 2>(self, place, 2, step, found);
    }
    heads<false, D>(self, place, axis, step, found);
  }

 private:
  static constexpr std::uint32_t kMore = std::uint32_t{1} << 31;  ///< beside a sphere: another one is behind it
  /// To a cell along one axis.
  struct Step {
    std::ptrdiff_t offset;
    std::uint32_t away;  // the box it leads into, shifted to its bits of a candidate
  };
  static constexpr double kCellsAParticle = 8;

  std::uint32_t shifted(std::int32_t boxes) const { return static_cast<std::uint32_t>(boxes) << packing_.slot_bits; }

  std::ptrdiff_t index(const Place& place) const {
    std::ptrdiff_t at = place.wrapped[D - 1];
    for (int k = 0; k + 1 < D; ++k) at += stride_[k] * place.wrapped[k];
    return at;
  }

  /// Whether there are cells on all sides.
  bool whole(const Place& place) const {
    bool all = true;
    for (int k = 0; k < D; ++k)
      all = all && (periodic_[k] || (place.wrapped[k] > 0 && place.wrapped[k] + 1 < grid_.count(k)));
    return all;
  }

  /// Takes everybody in the cells around a place for a candidate, or only in those a step away along an axis. `whole`:
  /// all the cells are there. `ahead`: the axis, −1 for none, D for one known at run time.
  template <bool whole, int ahead>
  void heads(Slot self, const Place& place, int axis, int step, Candidates& found) {
    const std::uint32_t* const first = first_.data();
    Step to[D][3];
    int number[D];
    bool nobody = false;
    for (int k = 0; k < D; ++k) {
      const Step* const here = &steps_[k][place.wrapped[k] + 1];
      const bool one = ahead >= 0 && (ahead < D ? k == ahead : k == axis);
      int low = -1, high = 1;
      if constexpr (!whole) {
        if (!periodic_[k] && place.wrapped[k] == 0) low = 0;
        if (!periodic_[k] && place.wrapped[k] + 1 == grid_.count(k)) high = 0;
      }
      if (one) {
        nobody = nobody || step < low || step > high;  // beyond the wall
        to[k][0] = here[nobody ? 0 : step];
        number[k] = nobody ? 0 : 1;
      } else {
        for (int c = low; c <= high; ++c) to[k][c - low] = here[c];
        number[k] = whole ? 3 : high - low + 1;
      }
    }
    // The first of each cell, if there is one: without a branch. The difference of the boxes is the image.
    const std::uint32_t away = shifted(place.boxes), here = here_;
    std::uint32_t* const start = found.packed.data();
    std::uint32_t *end = start, any = 0;
    const auto head = [&](std::ptrdiff_t cell, std::uint32_t box) {
      const std::uint32_t candidate = first[cell] - box;
      *end = candidate;
      const bool there = first[cell] != kNobody;
      any |= there ? candidate ^ here : 0;
      end += there ? 1 : 0;
    };
    for (int a = 0; a < number[0]; ++a)
      for (int b = 0; b < number[1]; ++b) {
        const std::ptrdiff_t row = to[0][a].offset + to[1][b].offset;
        const std::uint32_t box = away + to[0][a].away + to[1][b].away;
        if constexpr (D == 2)
          head(row, box);
        else
          for (int c = 0; c < number[2]; ++c) head(row + to[2][c].offset, box + to[2][c].away);
      }
    found.count = static_cast<unsigned>(end - start);
    if ((any & kMore) != 0) any |= follow(found);
    found.shifted = (any & ~kMore) >> packing_.slot_bits != 0;
    if (found.shifted && 2 * widest_ + 1 > packing_.largest()) check(place, found);
    const std::uint32_t own = packing_.pack(self, 0);
    std::uint32_t padding[8];
    for (auto& p : padding) p = own;
    std::memcpy(found.packed.data() + found.count, padding, sizeof padding);
  }

  /// Appends those behind the first of their cells.
  std::uint32_t follow(Candidates& found) const {
    std::uint32_t any = 0;
    for (unsigned q = 0; q < found.count; ++q) {
      const std::uint32_t candidate = found.packed[q];
      if ((candidate & kMore) == 0) continue;
      found.packed[q] = candidate & ~kMore;
      const Slot slot = packing_.slot(candidate);
      // The box that was taken from the candidate is taken from who comes next, too.
      const std::uint32_t box = packing_.pack(slot, boxes_[slot]) - (candidate & ~kMore), next = link_[slot] - box;
      any |= next ^ here_;
      if (found.count + 9u > found.packed.size()) found.packed.resize(2 * found.packed.size());
      found.packed[found.count++] = next;
    }
    return any;
  }

  /// Where spheres have come so far that a difference of boxes may not fit: look at each.
  void check(const Place& place, const Candidates& found) const {
    const Image<D> own = packing_.image(packing_.pack(0, place.boxes));
    for (unsigned q = 0; q < found.count; ++q) {
      const Image<D> theirs = packing_.image(packing_.pack(0, boxes_[packing_.slot(found.packed[q])]));
      for (int k = 0; k < D; ++k)
        if (std::abs(theirs[k] - own[k]) + 1 > packing_.largest() + 1) throw_too_far();
    }
  }

  Packing<D> packing_;
  CellGrid<D> grid_;
  std::ptrdiff_t stride_[D];
  std::vector<Step> steps_[D];  // to the cells −1 … count along each axis
  std::int32_t one_[D];         // a box along each axis, as a linear image
  bool periodic_[D];
  PageVector<std::uint32_t> first_;  // of each cell: a sphere with the boxes of its place, and kMore; or kNobody
  PageVector<std::uint32_t> link_;   // by slot: who is behind it in its cell, as first_ has it
  PageVector<std::int32_t> boxes_;   // by slot: of its place
  std::uint32_t here_;               // a candidate in the same box, but for its slot
  std::int32_t widest_ = 0;          // the farthest box anyone has come to
};

}  // namespace carom
