#pragma once
// Who is in which cell, for dilute systems: cells as small as a diameter, most of them empty, with a list through the
// spheres of each. A sphere that crosses into another cell looks at the new ones around it.

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
      : packing_(packing), grid_(box, smallest, x, kCellsAParticle), first_(grid_.cells(), kNobody), link_(x.size()) {
    stride_[D - 1] = 1;
    for (int k = D - 1; k > 0; --k) stride_[k - 1] = stride_[k] * grid_.count(k);
    for (int k = 0; k < D; ++k) {
      one_[k] = 1 << (packing.field_bits * k);
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

  void insert(Slot i, const Place& place) {
    std::uint32_t& first = first_[index(place)];
    link_[i] = {first, place.boxes};
    first = i;
  }
  void remove(Slot i, const Place& place) {
    std::uint32_t* at = &first_[index(place)];
    while (*at != i) at = &link_[*at].next;
    *at = link_[i].next;
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
    bool inner = true;
    for (int k = 0; k < D; ++k) inner = inner && place.wrapped[k] > 0 && place.wrapped[k] + 1 < grid_.count(k);
    unsigned n = 0;
    if (inner) {
      const std::uint32_t* const middle = &first_[index(place)];
      for (int a = -1; a <= 1; ++a) {
        if constexpr (D == 2) n = row(middle + a * stride_[0], place.boxes, n);
        if constexpr (D == 3)
          for (int b = -1; b <= 1; ++b) n = row(middle + a * stride_[0] + b * stride_[1], place.boxes, n);
      }
    } else {
      int low[D], high[D];
      for (int k = 0; k < D; ++k) low[k] = -1, high[k] = 1;
      n = outer(place, low, high);
    }
    follow(self, n, found);
  }

  /// Everybody in the cells that came into view when the sphere crossed along an axis.
  void ahead(Slot self, const Place& place, int axis, int step, Candidates& found) {
    bool inner = true;
    for (int k = 0; k < D; ++k) inner = inner && place.wrapped[k] > 0 && place.wrapped[k] + 1 < grid_.count(k);
    unsigned n = 0;
    if (inner) {
      const std::uint32_t* const middle = &first_[index(place)] + step * stride_[axis];
      if (axis == D - 1) {
        for (int a = -1; a <= 1; ++a) {
          if constexpr (D == 2) n = head(middle + a * stride_[0], place.boxes, n);
          if constexpr (D == 3)
            for (int b = -1; b <= 1; ++b) n = head(middle + a * stride_[0] + b * stride_[1], place.boxes, n);
        }
      } else {
        if constexpr (D == 2) n = row(middle, place.boxes, n);
        if constexpr (D == 3)
          for (int a = -1; a <= 1; ++a) n = row(middle + a * stride_[1 - axis], place.boxes, n);
      }
    } else {
      int low[D], high[D];
      for (int k = 0; k < D; ++k) low[k] = k == axis ? step : -1, high[k] = k == axis ? step : 1;
      n = outer(place, low, high);
    }
    follow(self, n, found);
  }

 private:
  struct Link {
    std::uint32_t next;
    std::int32_t boxes;
  };
  struct Seen {
    std::uint32_t slot;
    std::int32_t away;  // the box of the cell it was seen in
  };
  static constexpr double kCellsAParticle = 8;

  std::ptrdiff_t index(const Place& place) const {
    std::ptrdiff_t at = place.wrapped[D - 1];
    for (int k = 0; k + 1 < D; ++k) at += stride_[k] * place.wrapped[k];
    return at;
  }

  /// Whoever is first in a cell, if anybody: without a branch.
  unsigned head(const std::uint32_t* first, std::int32_t away, unsigned n) {
    who_[n] = {*first, away};
    return n + (*first != kNobody ? 1 : 0);
  }
  unsigned row(const std::uint32_t* middle, std::int32_t away, unsigned n) {
    n = head(middle - 1, away, n);
    n = head(middle, away, n);
    return head(middle + 1, away, n);
  }
  /// The same where cells may lie beyond the box.
  unsigned outer(const Place& place, const int* low, const int* high) {
    struct Step {
      std::ptrdiff_t offset;
      std::int32_t away;
    } steps[D][3];
    int number[D];
    for (int k = 0; k < D; ++k) {
      number[k] = 0;
      for (int s = low[k]; s <= high[k]; ++s) {
        int c = place.wrapped[k] + s;
        std::int32_t away = 0;
        if (c < 0 || c >= grid_.count(k)) {
          if (!periodic_[k]) continue;
          away = c < 0 ? -one_[k] : one_[k];
          c = c < 0 ? grid_.count(k) - 1 : 0;
        }
        steps[k][number[k]++] = {c * stride_[k], away};
      }
    }
    unsigned n = 0;
    for (int a = 0; a < number[0]; ++a)
      for (int b = 0; b < number[1]; ++b) {
        const std::ptrdiff_t at = steps[0][a].offset + steps[1][b].offset;
        const std::int32_t away = place.boxes + steps[0][a].away + steps[1][b].away;
        if constexpr (D == 2)
          n = head(&first_[at], away, n);
        else
          for (int c = 0; c < number[2]; ++c) n = head(&first_[at + steps[2][c].offset], away + steps[2][c].away, n);
      }
    return n;
  }

  /// Takes the heads that were seen and those behind them for candidates.
  void follow(Slot self, unsigned n, Candidates& found) {
    std::uint32_t any = 0;
    for (unsigned q = 0; q < n; ++q) {
      if (n + 9 > who_.size()) who_.resize(2 * who_.size());
      if (found.packed.size() < who_.size()) found.packed.resize(who_.size());
      const Seen seen = who_[q];
      const Link link = link_[seen.slot];
      const std::int32_t image = link.boxes - seen.away;
      any |= static_cast<std::uint32_t>(image);
      found.packed[q] = packing_.pack(seen.slot, image);
      who_[n] = {link.next, seen.away};
      n += link.next != kNobody ? 1 : 0;
    }
    if (any != 0 && 2 * widest_ + 1 > packing_.largest()) check(n);
    found.shifted = any != 0;
    found.count = n;
    for (unsigned q = n; q % 8 != 0; ++q) found.packed[q] = packing_.pack(self, 0);
  }

  /// Where spheres have come so far that a difference of boxes may not fit: look at each.
  void check(unsigned n) const {
    for (unsigned q = 0; q < n; ++q) {
      const Image<D> boxes = packing_.image(packing_.pack(0, link_[who_[q].slot].boxes));
      const Image<D> away = packing_.image(packing_.pack(0, who_[q].away));
      for (int k = 0; k < D; ++k)
        if (std::abs(boxes[k] - away[k]) > packing_.largest()) throw_too_far();
    }
  }

  Packing<D> packing_;
  CellGrid<D> grid_;
  std::ptrdiff_t stride_[D];
  std::int32_t one_[D];  // a box along each axis, as a linear image
  bool periodic_[D];
  PageVector<std::uint32_t> first_;
  PageVector<Link> link_;
  std::vector<Seen> who_ = std::vector<Seen>(64);
  std::int32_t widest_ = 0;  // the farthest box anyone has come to
};

}  // namespace carom
