// SPDX-License-Identifier: BSD-3-Clause
#include "engine/search/region_cells.h"

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
}

template <int D>
const typename RegionCells<D>::Located& RegionCells<D>::locate(const Vec<D>& x) {
  if (x == located_.x) return located_;
  located_.x = x;
  const Cell<D> cell = located_.cell = grid_.cell(x);
  located_.boxes = grid_.boxes(cell);
  for (int k = 0; k < D; ++k) {
    const double within = (x[k] - grid_.face(k, cell[k])) * grid_.inverse_edge(k);
    located_.place[k] = static_cast<std::int32_t>(std::clamp(within * kPositionsPerCell, 0.0, kPositionsPerCell - 1));
  }
  return located_;
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

template <int D>
typename RegionCells<D>::Found RegionCells<D>::find(const Vec<D>& x, double reach) {
  static constexpr CellView kHere{};
  const auto& [at, cell, boxes, place] = locate(x);
  NearTask task{};
  task.lines = lines_.data();
  task.next = next_.data();
  const double most = rounded(reach);
  double rounding = 0;
  std::size_t cells = 1, images = 1;  // images: how often a cell may be visited
  for (int k = 0; k < D; ++k) {
    const std::int32_t count = grid_.count(k), here = cell[k] - boxes[k] * count;
    const double edge = grid_.edge(k), scale = edge / kPositionsPerCell;
    task.scale[k] = static_cast<float>(scale);
    rounding += scale * scale;
    const std::int32_t range = most <= edge ? 1 : static_cast<std::int32_t>(std::ceil(most / edge));
    std::int32_t low = -range, high = range;
    if (!grid_.box().periodic(k)) low = std::max(low, -here), high = std::min(high, count - 1 - here);
    const CellStep* step = steps_[k].data() + here + low + margin_;
    auto& views = views_[k];
    views.resize(static_cast<std::size_t>(high - low) + 1);
    float corner = static_cast<float>(low * static_cast<std::int32_t>(kPositionsPerCell) - place[k]);
    for (CellView& view : views) {
      const float gap =
          std::max(std::max(corner - 1, -corner - static_cast<float>(kPositionsPerCell)), 0.0f) * task.scale[k];
      view = {*step++, corner * task.scale[k], gap * gap};
      corner += static_cast<float>(kPositionsPerCell);
    }
    task.view[k] = views.data();
    task.views[k] = static_cast<unsigned>(views.size());
    cells *= views.size();
    images *= 1 + 2 * static_cast<std::size_t>(range) / static_cast<std::size_t>(count);
  }
  if constexpr (D == 2) task.view[2] = &kHere, task.views[2] = 1;
  const double limit = (reach + std::sqrt(rounding)) * (1 + 1e-5);
  task.limit_squared = static_cast<float>(limit * limit);
  // Additional lines of crowded cells may all be visited.
  const std::size_t room = 8 * (cells + (lines_.size() - grid_.cells()) * images);
  if (slots_.size() < room) slots_.resize(2 * room), away_.resize(2 * room);
  const unsigned n = kernels_.near(task, slots_.data(), away_.data());
  return {{slots_.data(), n}, away_.data(), packing_.linear(boxes)};
}

template class RegionCells<2>;
template class RegionCells<3>;

}  // namespace carom
