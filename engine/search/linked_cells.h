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

/// The candidates that a search found, padded with the sphere itself to a multiple of kScanLanes, and working memory.
struct Candidates {
  Candidates() { grow(64); }
  Candidates(const Candidates&) = delete;
  Candidates& operator=(const Candidates&) = delete;
  void grow(std::size_t room) {
    packed.resize(room);
    task.candidates = packed.data();
    task.room = static_cast<unsigned>(room);
  }

  CellsTask task;
  std::vector<std::uint32_t> packed;
};

template <int D>
class LinkedCells {
 public:
  using Place = CellPlace<D>;

  /// Makes cells of edge at least `smallest` for spheres in `slots` slots.
  LinkedCells(const Box<D>& box, const Packing<D>& packing, const ScanKernels& kernels, double smallest,
              const Extent<D>& extent, std::size_t slots)
      : packing_(packing), kernels_(kernels), grid_(box, smallest, extent, kCellsAParticle), link_(slots) {
    for (int k = 0; k < D; ++k) {
      one_[k] = 1 << (packing.field_bits * k);
      periodic_[k] = box.periodic(k);
      faces_.origin[k] = grid_.face(k, 0);
      faces_.edge[k] = grid_.edge(k);
      faces_.lowest[k] =
          periodic_[k] ? -std::numeric_limits<double>::infinity() : 0;  // the outermost cells have no outer face
      faces_.highest[k] = periodic_[k] ? std::numeric_limits<double>::infinity() : grid_.count(k);
    }
    lay_out();
  }

  /// Call before any sphere is inserted: saves memory if most spheres stay near these positions.
  void confine(std::span<const Vec<D>> places) {
    grid_.confine(places, kCellsAround, D - 1);
    lay_out();
  }

  const CellGrid<D>& grid() const { return grid_; }
  /// The farthest box that a sphere has reached.
  std::int32_t widest() const { return widest_; }

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
  /// Starts to fetch the cells of scan_around() or, if `step` is not 0, of scan_ahead() after the next step along the
  /// axis; `found` is working memory.
  void prefetch(const Place& place, int axis, int step, Candidates& found) const {
    const CellsTask& task = found.task;
    aim_beyond(place, axis, step, found);
    for (unsigned r = 0; r < task.rows->count; ++r) {
      const std::uint32_t* const row = task.first + task.rows->step[r].offset;
      prefetch_line(row);
      prefetch_line(row + 3);
    }
  }
  /// Starts to fetch the links of the first spheres of these cells, and calls fetch(slot) for each first sphere.
  template <class Fetch>
  void prefetch_spheres(const Place& place, int axis, int step, Candidates& found, Fetch&& fetch) const {
    aim_beyond(place, axis, step, found);
    if (found.task.rows->count == 0) return;
    kernels_.heads(found.task);
    for (unsigned q = 0; q < found.task.count; ++q) {
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
    if (advance(place, axis, step)) {
      const std::int32_t boxes = (place.unwrapped[axis] - place.wrapped[axis]) / grid_.count(axis);
      if (std::abs(boxes) > packing_.largest()) throw_too_far();
      widest_ = std::max(widest_, std::abs(boxes));
    }
    insert(i, place);
  }

  /// Finds all spheres in the cells between two unwrapped cells, as seen from the box that holds the origin.
  void find_between(const Cell<D>& low, const Cell<D>& high, std::vector<std::uint32_t>& found) const {
    found.clear();
    collect(low, high, {}, found);
  }

  /// Finds all spheres in the sphere's cell and in the cells around it, and the first contact with them. `latest` as in
  /// ScanKernels.
  ScanResult scan_around(const ScanSetting& setting, Slot self, const Place& place, bool latest,
                         Candidates& found) const {
    aim(place, kAround, found);
    found.task.own = packing_.pack(self, place.boxes);  // if it is alone in its cell
    return search(setting, self, place, latest, found);
  }

  /// Finds all spheres in the cells that became neighbours when the sphere crossed a face, and the first contact with
  /// them.
  ScanResult scan_ahead(const ScanSetting& setting, Slot self, const Place& place, unsigned face,
                        Candidates& found) const {
    aim(place, face, found);
    if (found.task.rows->count == 0) {  // beyond a wall
      found.task.count = 0;
      return {std::numeric_limits<double>::infinity(), 0, false};
    }
    return search(setting, self, place, false, found);
  }

  /// Where a sphere with this record leaves its cell if it flies straight.
  Crossing crossing(const Record<D>& r, const Place& place) const {
    return kernels_.crossing[D - 2](faces_, reinterpret_cast<const double*>(&r), place.unwrapped);
  }

 private:
  static constexpr double kCellsAParticle = 8;
  static constexpr std::int32_t kCellsAround = 3;  // margin around the cells of confine()

  static constexpr unsigned kKinds = 2 * D - 1;     // of rows: around, and one step back or forth along an axis
  static constexpr unsigned kAround = 2 * D;        // instead of a face
  static constexpr std::size_t kMostPatterns = 32;  // along an axis, so that rows_ takes 2 MB at most
  /// The cells to search ahead of a face, or around.
  struct Region {
    alignas(16) std::uint32_t wanted[4];  // as in CellsTask
    std::ptrdiff_t shift;                 // from the sphere's cell to the first one of its row
    unsigned kind;                        // of rows
  };
  static constexpr std::array<Region, 2 * D + 1> kRegions = [] {
    std::array<Region, 2 * D + 1> regions{};
    for (unsigned face = 0; face <= kAround; ++face) {
      const bool in_row = face / 2 == D - 1;  // one cell of each row, not three
      for (unsigned l = 0; l < (in_row ? 1 : 3); ++l) regions[face].wanted[l] = ~0u;
      regions[face].shift = face == kAround - 1 ? 1 : -1;
      regions[face].kind = face < 2 * (D - 1) ? face + 1 : 0;
    }
    return regions;
  }();

  /// A step to a cell along one axis.
  struct Step {
    std::ptrdiff_t offset;  // is added to the number of the cell
    std::uint32_t away;     // the boxes that it crosses, as in HeadStep
    std::uint32_t pattern;  // is added to the index in rows_: how its neighbours are stored
  };

  std::uint32_t shifted(std::int32_t boxes) const { return static_cast<std::uint32_t>(boxes) << packing_.slot_bits; }

  std::size_t index(const Place& place) const {
    std::ptrdiff_t at = place.wrapped[D - 1] + 1;
    for (int k = 0; k + 1 < D; ++k) at += step(place, k).offset;
    return static_cast<std::size_t>(at);
  }
  const Step& step(const Place& place, int axis) const {
    return *(steps_[static_cast<std::size_t>(axis)].data() + place.wrapped[axis] + 1);
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
    std::uint32_t combinations = kKinds;
    std::array<std::vector<std::int32_t>, D - 1> examples;  // a cell of each pattern
    for (int k = D - 2; k >= 0; --k) {
      confined_ = confined_ || grid_.rows(k) != grid_.count(k);
      const std::int32_t count = grid_.count(k);
      steps_[k].clear();
      for (std::int32_t c = -1; c <= count; ++c) {
        const std::int32_t boxes = c < 0 ? -1 : c < count ? 0 : 1;
        steps_[k].push_back({cells * grid_.row(k, c - boxes * count), shifted(boxes * one_[k]), 0});
      }
      for (std::int32_t c = 0; c < count; ++c) {
        const auto same = [&](std::int32_t other) {
          const Step *const a = &steps_[k][static_cast<std::size_t>(c) + 1],
                            *const b = &steps_[k][static_cast<std::size_t>(other) + 1];
          const bool ends = periodic_[k] || ((c == 0) == (other == 0) && (c == count - 1) == (other == count - 1));
          return ends && std::ranges::all_of(std::array{-1, 1}, [&](int d) {
                   return a[d].offset - a->offset == b[d].offset - b->offset && a[d].away == b[d].away;
                 });
        };
        const auto known = std::ranges::find_if(examples[k], same);
        const auto pattern = static_cast<std::uint32_t>(known - examples[k].begin());
        if (known == examples[k].end()) examples[k].push_back(c);
        steps_[k][static_cast<std::size_t>(c) + 1].pattern = combinations * pattern;
        if (examples[k].size() > kMostPatterns) {  // too many separate parts: all cells are stored
          grid_.spread();
          return lay_out();
        }
      }
      cells *= grid_.rows(k);
      combinations *= static_cast<std::uint32_t>(examples[k].size());
    }
    first_.assign(static_cast<std::size_t>(cells + 3), kEmpty);
    rows_.resize(combinations);
    Place place{};
    for (const std::int32_t a : examples[0])
      for (const std::int32_t b : D == 3 ? examples[D - 2] : std::vector<std::int32_t>{0}) {
        place.wrapped[0] = static_cast<std::uint16_t>(a);
        if (D == 3) place.wrapped[1] = static_cast<std::uint16_t>(b);
        for (unsigned kind = 0; kind < kKinds; ++kind) {
          const int axis = kind == 0 ? D : (static_cast<int>(kind) - 1) / 2;
          make_rows(place, axis, kind % 2 == 0 ? 1 : -1, rows_[pattern(place) + kind]);
        }
      }
  }
  /// How the neighbours of a cell are stored: an index in rows_.
  unsigned pattern(const Place& place) const {
    unsigned pattern = 0;
    for (int k = 0; k + 1 < D; ++k) pattern += step(place, k).pattern;
    return pattern;
  }
  /// Moves a place into the next cell along an axis. Returns whether it passed through a face of the periodic box.
  bool advance(Place& place, int axis, int step) const {
    const int to = place.wrapped[axis] + step, count = grid_.count(axis);
    place.unwrapped[axis] += step;
    place.wrapped[axis] = static_cast<std::uint16_t>(to < 0 ? count - 1 : to < count ? to : 0);
    if (to >= 0 && to < count) return false;
    place.boxes += step * one_[axis];
    return true;
  }
  /// Sets the rows of the cells around a cell, or only of those that are `step` cells away along an axis.
  void make_rows(const Place& place, int axis, int step, HeadRows& rows) const {
    int low[2]{}, high[2]{};
    const Step* own[2]{};
    for (int k = 0; k < D - 1; ++k) {
      const int here = place.wrapped[k];
      low[k] = k == axis ? step : -1, high[k] = k == axis ? step : 1;
      if (!periodic_[k]) {  // no cells exist beyond walls
        low[k] = std::max(low[k], -here);
        high[k] = std::min(high[k], grid_.count(k) - 1 - here);
      }
      own[k] = &this->step(place, k);
    }
    rows.count = 0;
    const auto add = [&](int a, int b) {
      HeadStep& to = rows.step[rows.count++];
      to.offset = own[0][a].offset - own[0]->offset;
      std::uint32_t away = own[0][a].away;
      if (D == 3) to.offset += own[1][b].offset - own[1]->offset, away += own[1][b].away;
      std::fill_n(to.away, 4, away);
    };
    for (int a = low[0]; a <= high[0]; ++a)
      for (int b = low[1]; b <= high[1]; ++b)
        if (a != 0 || b != 0) add(a, b);
    if (low[0] <= 0 && high[0] >= 0 && low[1] <= 0 && high[1] >= 0) add(0, 0);
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

  /// Sets a task to the cells ahead of a face, or around.
  void aim(const Place& place, unsigned face, Candidates& found) const {
    const Region& region = kRegions[face];
    CellsTask& task = found.task;
    task.first = first_.data() + index(place) + region.shift;
    task.rows = &rows_[pattern(place) + region.kind];
    task.wanted = region.wanted;
    task.link = link_.data();
    task.away = shifted(place.boxes);
    task.own = kEmpty;
  }
  /// Sets a task to the cells that the next step along an axis will make neighbours, or to those around if `step` is 0.
  void aim_beyond(Place place, int axis, int step, Candidates& found) const {
    if (step == 0) return aim(place, kAround, found);
    advance(place, axis, step);
    aim(place, static_cast<unsigned>(2 * axis + (step > 0 ? 1 : 0)), found);
  }

  /// Executes a task; `place` is that of the sphere.
  [[gnu::always_inline]] ScanResult search(const ScanSetting& setting, Slot self, const Place& place, bool latest,
                                           Candidates& found) const {
    CellsTask& task = found.task;
    task.self = packing_.pack(self, 0);
    const ScanResult first = kernels_.search[D - 2](setting, task, latest);
    if (task.count + 8 >= task.room) [[unlikely]]
      return search_again(setting, self, place, latest, found);
    if (task.same < task.count && 2 * widest_ + 1 > packing_.largest()) [[unlikely]]
      check(place, found);
    return first;
  }

  [[gnu::noinline]] ScanResult search_again(const ScanSetting& setting, Slot self, const Place& place, bool latest,
                                            Candidates& found) const {
    found.grow(2 * found.packed.size());
    return search(setting, self, place, latest, found);
  }

  /// Appends all spheres in the cells between two corners; `at` and `seen`, the box, are of the axes before `axis`.
  void collect(const Cell<D>& low, const Cell<D>& high, Image<D> seen, std::vector<std::uint32_t>& found, int axis = 0,
               std::ptrdiff_t at = 1) const {
    const std::int32_t count = grid_.count(axis);
    const std::int32_t first = periodic_[axis] ? low[axis] : std::max(low[axis], 0);
    const std::int32_t last = periodic_[axis] ? high[axis] : std::min(high[axis], count - 1);
    for (std::int32_t c = first; c <= last; ++c) {
      seen[axis] = grid_.boxes(axis, c);
      const std::int32_t wrapped = c - seen[axis] * count;
      const std::ptrdiff_t cell = at + (axis < D - 1 ? (steps_[axis].data() + wrapped + 1)->offset : wrapped);
      if (axis < D - 1) {
        collect(low, high, seen, found, axis + 1, cell);
        continue;
      }
      std::uint32_t next = first_[static_cast<std::size_t>(cell)];
      while (next != kEmpty) {
        const Slot j = packing_.slot(next & ~kMoreInCell);
        if (2 * widest_ + 1 > packing_.largest()) [[unlikely]] {
          const Image<D> theirs = packing_.image(packing_.pack(0, link_[j].boxes));
          for (int k = 0; k < D; ++k)
            if (std::abs(theirs[k] - seen[k]) > packing_.largest()) throw_too_far();
        }
        found.push_back(packing_.pack(j, link_[j].boxes - packing_.linear(seen)));
        next = (next & kMoreInCell) != 0 ? link_[j].next : kEmpty;
      }
    }
  }

  /// Checks every candidate, because spheres have moved so many boxes that a difference of images may overflow. The
  /// image differs from that of the two boxes by at most 1, for a pair seen through a face. An overflow of the bits of
  /// one axis, which changes the next axis too, would make it differ by more, or give the one value in these bits that
  /// is beyond the largest.
  [[gnu::noinline]] void check(const Place& place, const Candidates& found) const {
    const Image<D> own = packing_.image(packing_.pack(0, place.boxes));
    for (unsigned q = 0; q < found.task.count; ++q) {
      const Image<D> theirs = packing_.image(packing_.pack(0, link_[packing_.slot(found.packed[q])].boxes)),
                     seen = packing_.image(found.packed[q]);
      for (int k = 0; k < D; ++k)
        if (std::abs(seen[k]) > packing_.largest() || std::abs(theirs[k] - own[k] - seen[k]) > 1) throw_too_far();
    }
  }

  Packing<D> packing_;
  const ScanKernels& kernels_;
  CellGrid<D> grid_;
  std::array<std::vector<Step>, D - 1> steps_;  // to the cells −1 … count along each axis but the last
  std::int32_t one_[D];                         // one box along each axis, as a linear image
  bool periodic_[D];
  CellFaces faces_;
  std::vector<HeadRows> rows_;  // by pattern() and kind
  bool confined_ = false;
  // By cell, in rows along the last axis: the first sphere with the image of its cell, and kMoreInCell; or kEmpty.
  PageVector<std::uint32_t> first_;
  PageVector<CellLink> link_;  // by slot
  std::int32_t widest_ = 0;
};

}  // namespace carom
