// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Cells with linked lists of their spheres, for dilute systems: cells as small as a diameter, most of them empty. When
// a sphere crosses into another cell, only the new cells around it are searched.

#include <utility>

#include "engine/base/pages.h"
#include "engine/base/prefetch.h"
#include "engine/search/next_event.h"
#include "engine/search/simd/scan.h"

namespace carom {

/// The candidates that a search found, padded with the sphere itself to a multiple of 8.
struct Candidates {
  std::vector<std::uint32_t> packed = std::vector<std::uint32_t>(64);
  unsigned count = 0;
  unsigned same = 0;  ///< the first `same` candidates are in the same box
};

template <int D>
class LinkedCells {
 public:
  using Place = CellPlace<D>;

  /// Makes cells of edge at least `smallest` for spheres in `slots` slots.
  LinkedCells(const Box<D>& box, const Packing<D>& packing, const ScanKernels& kernels, double smallest,
              const Extent<D>& extent, std::size_t slots)
      : packing_(packing),
        kernels_(kernels),
        grid_(box, smallest, extent, kCellsAParticle),
        link_(slots),
        here_(packing.pack(0, 0)) {
    for (int k = 0; k < D; ++k) {
      one_[k] = 1 << (packing.field_bits * k);
      periodic_[k] = box.periodic(k);
    }
    lay_out();
  }

  /// Call before any sphere is inserted: saves memory if most spheres stay near these positions.
  void confine(std::span<const Vec<D>> places) {
    grid_.confine(places, kCellsAround, D - 1);
    lay_out();
  }

  const CellGrid<D>& grid() const { return grid_; }

  /// The cell of a position.
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

  /// Starts to fetch what cross() and searches read of a sphere.
  void prefetch(Slot i) const { prefetch_line(&link_[i]); }
  /// Starts to fetch the cells of around() or, if `step` is not 0, of ahead() after the next step along the axis.
  void prefetch(const Place& place, int axis, int step) const {
    const HeadsTask task = step == 0 ? rows(place, D, 0) : rows_beyond(place, axis, step);
    for (unsigned a = 0; a < task.steps[0]; ++a)
      for (unsigned b = 0; b < task.steps[1]; ++b) {
        const std::uint32_t* const row = task.first + task.step[0][a].offset + task.step[1][b].offset;
        prefetch_line(row);
        prefetch_line(row + 3);
      }
  }
  /// Starts to fetch the links of the first spheres of these cells, and calls fetch(slot) for each first sphere.
  /// `found` is working memory.
  template <class Fetch>
  void prefetch_spheres(const Place& place, int axis, int step, Candidates& found, Fetch&& fetch) const {
    const HeadsTask task = step == 0 ? rows(place, D, 0) : rows_beyond(place, axis, step);
    const unsigned n = kernels_.heads(task, found.packed.data()).count;
    for (unsigned q = 0; q < n; ++q) {
      const Slot j = packing_.slot(found.packed[q] & ~kMoreInCell);
      fetch(j);
      if ((found.packed[q] & kMoreInCell) != 0) prefetch(j);
    }
  }

  /// Inserts a sphere that enters later.
  void admit(Slot i, const Place& place) {
    if (i >= link_.size()) link_.resize(i + 1);
    for (const std::int32_t b : packing_.image(packing_.pack(0, place.boxes))) widest_ = std::max(widest_, std::abs(b));
    if (widest_ > packing_.largest()) throw_too_far();
    insert(i, place);
  }
  void insert(Slot i, const Place& place) {
    if (confined_ && !grid_.holds(wrapped(place))) spread();
    std::uint32_t& first = first_[index(place)];
    link_[i] = {first, place.boxes};
    first = packing_.pack(i, place.boxes) | (first != kEmpty ? kMoreInCell : 0);
    mirror(place);
  }
  void remove(Slot i, const Place& place) {
    std::uint32_t *at = &first_[index(place)], *before = nullptr;
    while (packing_.slot(*at) != i) {
      before = at;
      at = &link_[packing_.slot(*at)].next;
    }
    *at = link_[i].next;
    if (before && *at == kEmpty) *before &= ~kMoreInCell;
    mirror(place);
  }

  /// Moves a sphere into the next cell along an axis.
  void cross(Slot i, Place& place, int axis, int step) {
    remove(i, place);
    place.unwrapped[axis] += step;
    const int to = place.wrapped[axis] + step, count = grid_.count(axis);
    if (to >= 0 && to < count) {
      place.wrapped[axis] = static_cast<std::uint16_t>(to);
    } else {  // through a face of the periodic box
      place.wrapped[axis] = static_cast<std::uint16_t>(to < 0 ? count - 1 : 0);
      const std::int32_t boxes = packing_.image(packing_.pack(0, place.boxes))[axis] + step;
      if (std::abs(boxes) > packing_.largest()) throw_too_far();
      widest_ = std::max(widest_, std::abs(boxes));
      place.boxes += step * one_[axis];
    }
    insert(i, place);
  }

  /// Finds all spheres in the cells that may hold positions within `reach` of the sphere's cell, the sphere included.
  void find_near(const Place& place, double reach, std::vector<std::uint32_t>& found) const {
    found.clear();
    Cell<D> low, high;
    for (int k = 0; k < D; ++k) {
      const auto range = static_cast<std::int32_t>(std::ceil(reach / grid_.edge(k)));
      low[k] = place.unwrapped[k] - range;
      high[k] = place.unwrapped[k] + range;
    }
    collect(low, high, found);
  }
  /// Finds all spheres in the cells between two corners, as seen from the box that holds the origin.
  void find_between(const Vec<D>& low, const Vec<D>& high, std::vector<std::uint32_t>& found) const {
    found.clear();
    collect(grid_.cell(low), grid_.cell(high), found);
  }

  /// Finds all spheres in the sphere's cell and in the cells around it, the sphere included.
  void around(Slot self, const Place& place, Candidates& found) const { search(self, place, D, 0, found); }

  /// Finds all spheres in the cells that became neighbours when the sphere crossed along an axis.
  void ahead(Slot self, const Place& place, int axis, int step, Candidates& found) const {
    search(self, place, axis, step, found);
  }

 private:
  struct Link {
    std::uint32_t next;  // the next sphere in the cell, coded as in first_
    std::int32_t boxes;  // image of the sphere's cell, as a linear image
  };
  static constexpr std::uint32_t kMoreInCell = std::uint32_t{1} << 31;  ///< flag: another sphere of the cell follows
  static constexpr double kCellsAParticle = 8;
  static constexpr std::int32_t kCellsAround = 3;  // margin around the cells of confine()

  std::uint32_t shifted(std::int32_t boxes) const { return static_cast<std::uint32_t>(boxes) << packing_.slot_bits; }

  std::size_t index(const Place& place) const {
    std::ptrdiff_t at = place.wrapped[D - 1] + 1;
    for (int k = 0; k + 1 < D; ++k) at += steps_[k][place.wrapped[k] + 1u].offset;
    return static_cast<std::size_t>(at);
  }
  static Cell<D> wrapped(const Place& place) {
    Cell<D> cell;
    for (int k = 0; k < D; ++k) cell[k] = place.wrapped[k];
    return cell;
  }

  /// Makes empty cells. A row along the last axis has an extra cell at both ends, and rows are read four cells at a
  /// time.
  void lay_out() {
    confined_ = false;
    std::ptrdiff_t cells = grid_.count(D - 1) + 2;
    for (int k = D - 2; k >= 0; --k) {
      confined_ = confined_ || grid_.rows(k) != grid_.count(k);
      steps_[k].clear();
      for (std::int32_t c = -1; c <= grid_.count(k); ++c) {
        const std::int32_t count = grid_.count(k), boxes = c < 0 ? -1 : c < count ? 0 : 1;
        steps_[k].push_back({cells * grid_.row(k, c - boxes * count), shifted(boxes * one_[k])});
      }
      cells *= grid_.rows(k);
    }
    first_.assign(static_cast<std::size_t>(cells + 3), kEmpty);
  }

  /// Stores all cells separately from now on, because a sphere is outside the confined cells.
  void spread() {
    const CellGrid<D> before = grid_;
    const auto old_steps = steps_;
    const PageVector<std::uint32_t> old_first = std::exchange(first_, {});
    grid_.spread();
    lay_out();
    const auto start = [](const auto& steps, const Cell<D>& row) {
      std::ptrdiff_t at = 0;
      for (std::size_t k = 0; k + 1 < D; ++k) at += (steps[k].data() + row[k] + 1)->offset;
      return at;
    };
    Cell<D> row{};
    for (row[0] = 0; row[0] < grid_.count(0); ++row[0])
      for (std::int32_t c = 0; c < (D == 3 ? grid_.count(1) : 1); ++c) {
        if (D == 3) row[1] = c;
        if (before.holds(row))
          std::copy_n(old_first.begin() + start(old_steps, row), grid_.count(D - 1) + 2,
                      first_.begin() + start(steps_, row));
      }
  }

  /// Updates the extra cells at the ends of a periodic row, which are images of its last and first cells.
  void mirror(const Place& place) {
    const int z = place.wrapped[D - 1], last = grid_.count(D - 1) - 1;
    if (!periodic_[D - 1] || (z > 0 && z < last)) return;
    const std::size_t at = index(place);
    const std::uint32_t first = first_[at], box = shifted(one_[D - 1]);
    const auto row = static_cast<std::size_t>(last) + 1;
    if (z == 0) first_[at + row] = first == kEmpty ? first : first - box;
    if (z == last) first_[at - row] = first == kEmpty ? first : first + box;
  }

  /// The cells around a cell, or only the cells one step away along an axis.
  HeadsTask rows(const Place& place, int axis, int step) const {
    static constexpr HeadStep kNone{0, 0};
    const bool in_row = axis == D - 1;  // one cell of each row, not three
    HeadsTask task{.first = first_.data() + place.wrapped[D - 1] + (in_row ? 1 + step : 0),
                   .step = {&kNone, &kNone},
                   .steps = {1, 1},
                   .wanted = in_row ? 1u : 7u,
                   .away = shifted(place.boxes),
                   .here = here_};
    for (int k = 0; k < D - 1; ++k) {
      const int here = place.wrapped[k];
      int low = k == axis ? step : -1, high = k == axis ? step : 1;
      if (!periodic_[k]) {  // no cells exist beyond walls
        low = std::max(low, -here);
        high = std::min(high, grid_.count(k) - 1 - here);
      }
      task.step[k] = steps_[k].data() + here + 1 + low;
      task.steps[k] = static_cast<unsigned>(std::max(high - low + 1, 0));
    }
    return task;
  }
  /// The cells that the next step along an axis will make neighbours; none if they are beyond the end of the box.
  HeadsTask rows_beyond(const Place& place, int axis, int step) const {
    const int to = place.wrapped[axis] + 2 * step;
    if (to < -1 || to > grid_.count(axis)) return {};
    return rows(place, axis, 2 * step);
  }

  /// Finds the candidates in the cells of rows().
  void search(Slot self, const Place& place, int axis, int step, Candidates& found) const {
    const Heads heads = kernels_.heads(rows(place, axis, step), found.packed.data());
    found.count = heads.count;
    std::uint32_t any = heads.any;
    if ((any & kMoreInCell) != 0) any |= follow(found);
    const bool elsewhere = (any & ~kMoreInCell) >> packing_.slot_bits != 0;
    found.same = elsewhere ? 0 : found.count;
    if (elsewhere && 2 * widest_ + 1 > packing_.largest()) check(place, found);
    std::fill_n(found.packed.data() + found.count, 8, packing_.pack(self, 0));  // follow() overwrites padding
  }

  /// Appends all spheres in the cells between two corners; `at` and `away` are the sums over the axes before `axis`.
  void collect(const Cell<D>& low, const Cell<D>& high, std::vector<std::uint32_t>& found, int axis = 0,
               std::ptrdiff_t at = 1, std::int32_t away = 0) const {
    const std::int32_t count = grid_.count(axis);
    const std::int32_t first = periodic_[axis] ? low[axis] : std::max(low[axis], 0);
    const std::int32_t last = periodic_[axis] ? high[axis] : std::min(high[axis], count - 1);
    for (std::int32_t c = first; c <= last; ++c) {
      const std::int32_t boxes = grid_.boxes(axis, c), seen = away + boxes * one_[axis];
      const std::int32_t wrapped = c - boxes * count;
      const std::ptrdiff_t cell = at + (axis < D - 1 ? (steps_[axis].data() + wrapped + 1)->offset : wrapped);
      if (axis < D - 1) {
        collect(low, high, found, axis + 1, cell, seen);
        continue;
      }
      std::uint32_t next = first_[static_cast<std::size_t>(cell)];
      while (next != kEmpty) {
        const Slot j = packing_.slot(next & ~kMoreInCell);
        found.push_back(packing_.pack(j, link_[j].boxes - seen));
        next = (next & kMoreInCell) != 0 ? link_[j].next : kEmpty;
      }
    }
  }

  /// Appends the later spheres of all cells whose first sphere has been found.
  std::uint32_t follow(Candidates& found) const {
    std::uint32_t any = 0;
    for (unsigned q = 0; q < found.count; ++q) {
      const std::uint32_t candidate = found.packed[q];
      if ((candidate & kMoreInCell) == 0) continue;
      found.packed[q] = candidate & ~kMoreInCell;
      const Slot slot = packing_.slot(candidate);
      // The box that was subtracted from the candidate is subtracted from the next one, too.
      const Link& link = link_[slot];
      const std::uint32_t box = packing_.pack(slot, link.boxes) - (candidate & ~kMoreInCell), next = link.next - box;
      any |= next ^ here_;
      if (found.count + 9u > found.packed.size()) found.packed.resize(2 * found.packed.size());
      found.packed[found.count++] = next;
    }
    return any;
  }

  /// Checks every candidate, because spheres have moved so many boxes that a difference of images may overflow.
  void check(const Place& place, const Candidates& found) const {
    const Image<D> own = packing_.image(packing_.pack(0, place.boxes));
    for (unsigned q = 0; q < found.count; ++q) {
      const Image<D> theirs = packing_.image(packing_.pack(0, link_[packing_.slot(found.packed[q])].boxes));
      for (int k = 0; k < D; ++k)
        if (std::abs(theirs[k] - own[k]) + 1 > packing_.largest()) throw_too_far();  // 1: seen through a face
    }
  }

  Packing<D> packing_;
  const ScanKernels& kernels_;
  CellGrid<D> grid_;
  std::array<std::vector<HeadStep>, D - 1> steps_;  // to the cells −1 … count along each axis but the last
  std::int32_t one_[D];                             // one box along each axis, as a linear image
  bool periodic_[D];
  bool confined_ = false;
  // By cell, in rows along the last axis: the first sphere with the image of its cell, and kMoreInCell; or kEmpty.
  PageVector<std::uint32_t> first_;
  PageVector<Link> link_;    // by slot
  std::uint32_t here_;       // a candidate in the same box, without its slot
  std::int32_t widest_ = 0;  // the farthest box that a sphere has reached
};

}  // namespace carom
