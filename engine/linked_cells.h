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
      : packing_(packing),
        grid_(box, smallest, x, kCellsAParticle),
        first_(grid_.cells(), kNobody),
        link_(x.size()),
        here_(packing.pack(0, 0)) {
    stride_[D - 1] = 1;
    for (int k = D - 1; k > 0; --k) stride_[k - 1] = stride_[k] * grid_.count(k);
    for (int k = 0; k < D; ++k) {
      one_[k] = 1 << (packing.field_bits * k);
      for (std::int32_t c = -1; c <= grid_.count(k); ++c) {
        typename CellGrid<D>::Step step{0, 0};
        grid_.step(k, c, step);
        steps_[k].push_back({static_cast<std::ptrdiff_t>(step.offset), join(0, shifted(step.boxes * one_[k]))});
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
    link_[i] = join(first, packing_.pack(i, place.boxes));
    first = i;
  }
  void remove(Slot i, const Place& place) {
    std::uint32_t& first = first_[index(place)];
    const std::uint32_t next = low(link_[i]);
    if (first == i) {
      first = next;
      return;
    }
    Slot before = first;
    while (low(link_[before]) != i) before = low(link_[before]);
    link_[before] = join(next, high(link_[before]));
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
    int low[D], high[D];
    bool whole = true;
    for (int k = 0; k < D; ++k) {
      low[k] = periodic_[k] || place.wrapped[k] > 0 ? -1 : 0;
      high[k] = periodic_[k] || place.wrapped[k] + 1 < grid_.count(k) ? 1 : 0;
      whole = whole && high[k] - low[k] == 2;
    }
    Seen* end;
    if (whole) {  // bounds that the compiler knows
      for (int k = 0; k < D; ++k) low[k] = -1, high[k] = 1;
      end = heads(place, low, high);
    } else {
      end = heads(place, low, high);
    }
    follow(self, end, found);
  }

  /// Everybody in the cells that came into view when the sphere crossed along an axis.
  void ahead(Slot self, const Place& place, int axis, int step, Candidates& found) {
    int low[D], high[D];
    for (int k = 0; k < D; ++k) {
      low[k] = periodic_[k] || place.wrapped[k] > 0 ? -1 : 0;
      high[k] = periodic_[k] || place.wrapped[k] + 1 < grid_.count(k) ? 1 : 0;
    }
    const int edge = step < 0 ? low[axis] : high[axis];
    Seen* const end = who_.data();
    if (edge != step) return follow(self, end, found);  // beyond the wall there is nobody
    low[axis] = high[axis] = step;
    follow(self, heads(place, low, high), found);
  }

 private:
  // Pairs of 32 bits, low half first: of a sphere the next one in its cell and itself, packed with the boxes of its
  // place; of a sphere that was seen its slot and the box of the cell it was seen in, shifted to its bits.
  using Link = std::uint64_t;
  using Seen = std::uint64_t;
  static std::uint64_t join(std::uint32_t low, std::uint32_t high) {
    return low | static_cast<std::uint64_t>(high) << 32;
  }
  static std::uint32_t low(std::uint64_t pair) { return static_cast<std::uint32_t>(pair); }
  static std::uint32_t high(std::uint64_t pair) { return static_cast<std::uint32_t>(pair >> 32); }
  /// To a cell along one axis.
  struct Step {
    std::ptrdiff_t offset;
    std::uint64_t away;  // shifted, in the high half
  };
  static constexpr double kCellsAParticle = 8;

  std::uint32_t shifted(std::int32_t boxes) const { return static_cast<std::uint32_t>(boxes) << packing_.slot_bits; }

  std::ptrdiff_t index(const Place& place) const {
    std::ptrdiff_t at = place.wrapped[D - 1];
    for (int k = 0; k + 1 < D; ++k) at += stride_[k] * place.wrapped[k];
    return at;
  }

  /// Whoever is first in the cells from `low` to `high` about a place, without a branch; returns the end of who_.
  Seen* heads(const Place& place, const int* low, const int* high) {
    const std::uint32_t* const first = first_.data();
    const std::uint64_t here = join(0, shifted(place.boxes));
    const Step* const x = &steps_[0][place.wrapped[0] + 1];
    const Step* const y = &steps_[1][place.wrapped[1] + 1];
    Seen* end = who_.data();
    const auto head = [&](std::ptrdiff_t cell, std::uint64_t away) {
      const std::uint32_t slot = first[cell];
      *end = away | slot;
      end += slot != kNobody ? 1 : 0;
    };
    for (int a = low[0]; a <= high[0]; ++a)
      for (int b = low[1]; b <= high[1]; ++b) {
        const std::ptrdiff_t row = x[a].offset + y[b].offset;
        const std::uint64_t away = here + x[a].away + y[b].away;
        if constexpr (D == 2) {
          head(row, away);
        } else {
          const Step* const z = &steps_[2][place.wrapped[2] + 1];
          for (int c = low[2]; c <= high[2]; ++c) head(row + z[c].offset, away + z[c].away);
        }
      }
    return end;
  }

  /// Takes the heads that were seen and those behind them for candidates.
  void follow(Slot self, const Seen* seen_end, Candidates& found) {
    Seen* who = who_.data();
    std::uint32_t* packed = found.packed.data();
    const Link* const links = link_.data();
    const std::uint32_t here = here_;
    auto n = static_cast<unsigned>(seen_end - who);
    std::size_t room = std::min(who_.size(), found.packed.size()) - 9;
    std::uint32_t any = 0;
    for (unsigned q = 0; q < n; ++q) {
      if (n >= room) {
        who_.resize(2 * who_.size());
        found.packed.resize(who_.size());
        who = who_.data();
        packed = found.packed.data();
        room = who_.size() - 9;
      }
      const Seen seen = who[q];
      const Link link = links[low(seen)];
      const std::uint32_t candidate = high(link) - high(seen);  // the difference of the boxes is the image
      any |= candidate ^ here;
      packed[q] = candidate;
      who[n] = (seen & 0xffffffff00000000) | low(link);
      n += low(link) != kNobody ? 1 : 0;
    }
    found.shifted = any >> packing_.slot_bits != 0;
    if (found.shifted && 2 * widest_ + 1 > packing_.largest()) check(n);
    found.count = n;
    const std::uint32_t nobody = packing_.pack(self, 0);
    for (unsigned q = 0; q < 8; ++q) packed[n + q] = nobody;
  }

  /// Where spheres have come so far that a difference of boxes may not fit: look at each.
  void check(unsigned n) const {
    for (unsigned q = 0; q < n; ++q) {
      const Image<D> boxes = packing_.image(high(link_[low(who_[q])]));
      const Image<D> away = packing_.image(high(who_[q]) + here_);
      for (int k = 0; k < D; ++k)
        if (std::abs(boxes[k] - away[k]) > packing_.largest()) throw_too_far();
    }
  }

  Packing<D> packing_;
  CellGrid<D> grid_;
  std::ptrdiff_t stride_[D];
  std::vector<Step> steps_[D];  // to the cells −1 … count along each axis
  std::int32_t one_[D];         // a box along each axis, as a linear image
  bool periodic_[D];
  PageVector<std::uint32_t> first_;
  PageVector<Link> link_;
  std::uint32_t here_;  // a candidate in the same box, but for its slot
  std::vector<Seen> who_ = std::vector<Seen>(64);
  std::int32_t widest_ = 0;  // the farthest box anyone has come to
};

}  // namespace carom
