// SPDX-License-Identifier: BSD-3-Clause
#include "engine/search/region_cells.h"

#include <algorithm>
#include <cmath>

#include "engine/base/elementary.h"

namespace carom {
namespace {

constexpr double kPositionsPerCell = 1024;    // positions within a cell along each axis
constexpr double kSpheresPerCell = 4;         // spheres per cell, at least: fewer would waste its line
constexpr std::int32_t kCellsAroundPart = 2;  // margin around the cells of confine()

}  // namespace

template <int D>
RegionCells<D>::RegionCells(const Box<D>& box, const Packing<D>& packing, const ScanKernels& kernels,
                            const Extent<D>& extent, double spheres, double reach, double farthest)
    : packing_(packing), kernels_(kernels), grid_(box, edge(box, extent, spheres, reach), extent) {
  for (int k = 0; k < D; ++k)
    margin_ = std::max(margin_, static_cast<std::int32_t>(std::ceil(rounded(farthest) / grid_.edge(k))));
}

template <int D>
double RegionCells<D>::edge(const Box<D>& box, const Extent<D>& extent, double spheres, double reach) {
  double volume = 1;
  for (int k = 0; k < D; ++k) volume *= box.bounded(k) ? box.edges[k] : extent.high[k] - extent.low[k];
  return std::max(rounded(reach), elementary::pow(kSpheresPerCell * volume / std::max(spheres, 1.0), 1.0 / D));
}

/// Adds a margin for rounded positions: each of two can be off by one unit along each axis.
template <int D>
double RegionCells<D>::rounded(double reach) {
  return reach * (1 + 2 * std::sqrt(D) / kPositionsPerCell);
}

template <int D>
void RegionCells<D>::confine(std::span<const Vec<D>> places) {
  grid_.confine(places, kCellsAroundPart);
}

template <int D>
std::vector<Slot> RegionCells<D>::spread() {
  std::vector<Slot> members;
  for (const CellLine& line : lines_)
    for (const Slot i : line.slot)
      if (i != kEmpty) members.push_back(i);
  grid_.spread();
  clear();
  return members;
}

template <int D>
void RegionCells<D>::clear() {
  lines_.clear();
  lines_.resize(grid_.cells());
  for (auto& line : lines_) std::fill_n(line.slot, 8, kEmpty);
  next_.assign(grid_.cells(), kEmpty);
  free_ = kEmpty;
  widest_ = 0;
  for (int k = 0; k < D; ++k) {
    steps_[k].clear();
    const std::int32_t unit = 1 << (packing_.field_bits * k), count = grid_.count(k);
    for (std::int32_t c = -margin_; c < count + margin_; ++c) {
      typename CellGrid<D>::Step step{0, 0};
      grid_.step(k, c, step);  // invalid beyond walls: never used there
      widest_ = std::max(widest_, std::abs(step.boxes));
      steps_[k].push_back({static_cast<std::uint32_t>(step.offset), step.boxes * unit});
    }
  }
  // A row of boxes is displaced along the first axis.
  const std::int32_t rows = (margin_ + grid_.count(1) - 1) / grid_.count(1);
  widest_ += static_cast<std::int32_t>(std::ceil(rows * std::abs(grid_.box().tilt) / grid_.box().edges[0]));
}

template <int D>
const typename RegionCells<D>::Located& RegionCells<D>::locate(const Vec<D>& x) {
  if (x == located_.x) return located_;
  located_.x = x;
  const Cell<D> cell = located_.cell = grid_.cell(x);
  located_.boxes = grid_.boxes(cell);
  for (int k = 0; k < D; ++k) located_.place[k] = place_in(k, x[k], cell[k]);
  if (grid_.box().tilt != 0) located_.place[0] = place_in(0, grid_.upright(x[0], located_.boxes[1]), cell[0]);
  return located_;
}

/// The place of a coordinate in a cell, in 1024ths.
template <int D>
std::int32_t RegionCells<D>::place_in(int axis, double x, std::int32_t cell) const {
  const double within = (x - grid_.face(axis, cell)) * grid_.inverse_edge(axis);
  return static_cast<std::int32_t>(std::clamp(within * kPositionsPerCell, 0.0, kPositionsPerCell - 1));
}

template <int D>
bool RegionCells<D>::insert(Slot i, const Vec<D>& x, Image<D>& boxes) {
  const auto& [at, cell, own_boxes, place] = locate(x);
  if (!grid_.holds(cell)) return false;
  boxes = own_boxes;
  std::uint32_t code = 0;
  for (int k = 0; k < D; ++k) code |= static_cast<std::uint32_t>(place[k]) << (10 * k);
  std::uint32_t line = static_cast<std::uint32_t>(grid_.index(cell));
  for (;;) {
    for (int q = 0; q < 8; ++q)
      if (lines_[line].slot[q] == kEmpty) {
        lines_[line].slot[q] = i;
        lines_[line].place[q] = code;
        return true;
      }
    if (next_[line] == kEmpty) {
      std::uint32_t fresh = free_;
      if (fresh != kEmpty) {
        free_ = next_[fresh];
      } else {
        fresh = static_cast<std::uint32_t>(lines_.size());
        lines_.emplace_back();
        next_.push_back(kEmpty);
      }
      std::fill_n(lines_[fresh].slot, 8, kEmpty);
      next_[fresh] = kEmpty;
      next_[line] = fresh;
    }
    line = next_[line];
  }
}

template <int D>
void RegionCells<D>::remove(Slot i, const Vec<D>& x) {
  const std::uint32_t first = static_cast<std::uint32_t>(grid_.index(grid_.cell(x)));
  for (std::uint32_t line = first, before = kEmpty;; before = line, line = next_[line]) {
    CellLine& cell = lines_[line];
    for (Slot& slot : cell.slot) {
      if (slot != i) continue;
      slot = kEmpty;
      const bool empty = std::all_of(cell.slot, cell.slot + 8, [](auto s) { return s == kEmpty; });
      if (before != kEmpty && empty) {
        next_[before] = next_[line];
        next_[line] = free_;
        free_ = line;
      }
      return;
    }
  }
}

/// Makes the views of the cells that a search reads along one axis. `here` and `place`: the cell of the position within
/// its box, and the place in it; `away` is added to the boxes. Returns how often a cell may be seen.
template <int D>
std::size_t RegionCells<D>::look_along(int axis, std::int32_t here, std::int32_t place, double reach,
                                       std::int32_t away) {
  const std::int32_t count = grid_.count(axis);
  const double edge = grid_.edge(axis);
  const auto scale = static_cast<float>(edge / kPositionsPerCell);
  const std::int32_t range = reach <= edge ? 1 : static_cast<std::int32_t>(std::ceil(reach / edge));
  std::int32_t low = -range, high = range;
  if (!grid_.box().periodic(axis)) low = std::max(low, -here), high = std::min(high, count - 1 - here);
  const CellStep* step = steps_[axis].data() + here + low + margin_;
  auto& views = views_[axis];
  views.resize(static_cast<std::size_t>(high - low) + 1);
  float corner = static_cast<float>(low * static_cast<std::int32_t>(kPositionsPerCell) - place);
  for (CellView& view : views) {
    const float gap = std::max(std::max(corner - 1, -corner - static_cast<float>(kPositionsPerCell)), 0.0f) * scale;
    view = {*step++, corner * scale, gap * gap};
    view.away += away;
    corner += static_cast<float>(kPositionsPerCell);
  }
  return 1 + 2 * static_cast<std::size_t>(range) / static_cast<std::size_t>(count);
}

template <int D>
typename RegionCells<D>::Found RegionCells<D>::find(const Vec<D>& x, double reach, const FlowFrame& flow) {
  static constexpr CellView kHere{};
  const auto& [at, cell, boxes, place] = locate(x);
  NearTask task{};
  task.lines = lines_.data();
  task.next = next_.data();
  const double most = rounded(flow.widened(reach));
  double rounding = 0;
  std::size_t cells = 1, images = 1;  // images: how often a cell may be visited
  for (int k = 0; k < D; ++k) {
    const double scale = grid_.edge(k) / kPositionsPerCell;
    task.scale[k] = static_cast<float>(scale);
    rounding += scale * scale;
    images *= look_along(k, cell[k] - boxes[k] * grid_.count(k), place[k], most, 0);
    task.view[k] = views_[k].data();
    task.views[k] = static_cast<unsigned>(views_[k].size());
    cells *= views_[k].size();
  }
  if constexpr (D == 2) task.view[2] = &kHere, task.views[2] = 1;
  const double limit = (reach + flow.widened(std::sqrt(rounding))) * (1 + 1e-5);
  task.limit_squared = task.cells_squared = static_cast<float>(limit * limit);
  if (flow.rate != 0) {
    const double wide = flow.widened(limit), mean = 0.5 * (flow.from + flow.to);
    task.cells_squared = static_cast<float>(wide * wide);
    task.mean_strain = static_cast<float>(mean);
    task.half_strain = static_cast<float>((0.5 * std::abs(flow.to - flow.from) + 1e-6 * (1 + std::abs(mean))));
  }
  // Additional lines of crowded cells may all be visited.
  const std::size_t room = 8 * (cells + (lines_.size() - grid_.cells()) * images);
  if (slots_.size() < room) slots_.resize(2 * room), away_.resize(2 * room);
  unsigned n = 0;
  if (grid_.box().tilt == 0) {
    n = kernels_.near(task, slots_.data(), away_.data());
  } else {  // in each row of boxes the position is elsewhere along the first axis
    const CellView* const end = views_[1].data() + views_[1].size();
    const std::int32_t unit = 1 << packing_.field_bits;
    for (const CellView* first = views_[1].data(); first != end; first += task.views[1]) {
      const CellView* const next = std::find_if(first, end, [&](const auto& v) { return v.away != first->away; });
      const double seen = grid_.upright(x[0], boxes[1] + first->away / unit);
      const std::int32_t c = grid_.cell(0, seen), box = grid_.boxes(0, c);
      look_along(0, c - box * grid_.count(0), place_in(0, seen, c), most, box - boxes[0]);
      task.view[0] = views_[0].data();
      task.view[1] = first;
      task.views[1] = static_cast<unsigned>(next - first);
      n += kernels_.near(task, slots_.data() + n, away_.data() + n);
    }
  }
  return {{slots_.data(), n}, away_.data(), packing_.linear(boxes)};
}

template class RegionCells<2>;
template class RegionCells<3>;

}  // namespace carom
