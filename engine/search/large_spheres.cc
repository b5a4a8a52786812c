// SPDX-License-Identifier: BSD-3-Clause
#include "engine/search/large_spheres.h"

#include <algorithm>

namespace carom {

template <int D>
LargeSpheres<D>::LargeSpheres(const LinkedCells<D>& cells, const Packing<D>& packing, std::span<const double> reach,
                              double small, double skin, PageVector<NextEvent<D>>& next_events)
    : cells_(cells), packing_(packing), reach_(reach), small_(small), skin_(skin), next_events_(next_events) {
  std::size_t all = 1;
  for (int k = 0; k < D; ++k) {
    blocks_[k] = static_cast<std::size_t>((cells.grid().count(k) + kCellsOfBlock - 1) / kCellsOfBlock);
    all *= blocks_[k];
  }
  list_of_.resize(all);
  for (Slot i = 0; i < reach.size(); ++i) admit(i, reach);
}

template <int D>
void LargeSpheres<D>::admit(Slot i, std::span<const double> reach) {
  reach_ = reach;
  number_.resize(std::max<std::size_t>(number_.size(), i + 1));
  number_[i] = kSmall;
  if (reach[i] <= small_) return;
  if (unused_.empty()) {
    unused_.push_back(static_cast<std::uint32_t>(large_.size()));
    large_.emplace_back();
  }
  number_[i] = unused_.back();
  unused_.pop_back();
  large_[number_[i]].high[0] = large_[number_[i]].low[0] - 1;  // no region yet
}

template <int D>
void LargeSpheres<D>::dismiss(Slot i) {
  clear(i);
  unused_.push_back(std::exchange(number_[i], kDismissed));
}

/// Calls visit(block, away, low, high) for each block between two unwrapped cells that is within `limit` of x, with the
/// box in which it is and its first and last cell, as seen from the box that holds the origin.
template <int D>
template <class Visit>
void LargeSpheres<D>::for_each_block(const Cell<D>& from, const Cell<D>& to, const Vec<D>& x, double limit,
                                     Visit&& visit) const {
  const CellGrid<D>& grid = cells_.grid();
  Image<D> away{};
  Cell<D> low, high;
  const auto along = [&](const auto& self, int axis, std::size_t before, double squared) -> void {
    const std::int32_t count = grid.count(axis);
    const bool periodic = grid.box().periodic(axis);
    for (std::int32_t c = from[axis], end; c <= to[axis]; c = end) {
      away[axis] = grid.boxes(axis, c);
      const std::int32_t first = away[axis] * count, number = (c - first) / kCellsOfBlock;
      end = first + std::min((number + 1) * kCellsOfBlock, count);
      low[axis] = c, high[axis] = end - 1;
      // The distance along the axis; the outermost cells have no outer face.
      const double below = periodic || c > 0 ? grid.face(axis, c) - x[axis] : 0,
                   above = periodic || end < count ? x[axis] - grid.face(axis, end) : 0,
                   far = std::max({below, above, 0.0}), sum = squared + far * far;
      if (sum > limit * limit) continue;
      const std::size_t at = before * blocks_[axis] + static_cast<std::size_t>(number);
      if (axis == D - 1)
        visit(at, away, low, high);
      else
        self(self, axis + 1, at, sum);
    }
  };
  along(along, 0, 0, 0);
}
/// for_each_block() for the region of a large sphere.
template <int D>
template <class Visit>
void LargeSpheres<D>::for_each_block(Slot i, Visit&& visit) const {
  const Large& own = large_[number_[i]];
  for_each_block(own.low, own.high, centre(i), range(i), visit);
}

/// Puts a large sphere and the listed ones that may touch it, as seen from its box, on each other's lists, unless they
/// are there already.
template <int D>
void LargeSpheres<D>::meet(Slot i, const Image<D>& away, std::span<const std::uint32_t> listed) {
  for (const std::uint32_t each : listed) {
    const Slot j = packing_.slot(each);
    if (j == i) continue;
    Image<D> image = packing_.image(each);
    for (int k = 0; k < D; ++k) {
      image[k] -= away[k];
      if (std::abs(image[k]) > packing_.largest()) throw_too_far();
    }
    const Vec<D> d = centre(i) - centre(j) + cells_.grid().box().shift(image);
    const double within = reach_[i] + reach_[j] + 2 * skin_;
    const std::uint32_t candidate = packing_.pack(j, packing_.linear(image));
    List& own = large_[number_[i]].list;
    if (d.squaredNorm() > within * within || std::ranges::find(own.all(), candidate) != own.all().end()) continue;
    add(own, candidate);
    add(large_[number_[j]].list, packing_.reversed(i, candidate));
  }
}

/// Takes a large sphere off all lists and empties its own.
template <int D>
void LargeSpheres<D>::clear(Slot i) {
  Large& own = large_[number_[i]];
  for (const std::uint32_t other : own.list.all())
    if (const std::uint32_t number = number_[packing_.slot(other)]; number != kSmall)
      large_[number].list.drop(packing_.reversed(i, other));
  own.list.clear();
  for_each_block(i, [&](std::size_t at, const auto&...) {
    auto& listed = lists_[list_of_[at]];
    std::erase_if(listed, [&](std::uint32_t each) { return packing_.slot(each) == i; });
    if (listed.empty() && list_of_[at] != 0) unused_lists_.push_back(std::exchange(list_of_[at], 0));
  });
}

template <int D>
void LargeSpheres<D>::renew(Slot i, const Vec<D>& x) {
  clear(i);
  Large& own = large_[number_[i]];
  for (int k = 0; k < D; ++k) next_events_[i].where.centre[k] = x[k];
  const CellGrid<D>& grid = cells_.grid();
  own.low = grid.cell(x - Vec<D>::Constant(range(i)));
  own.high = grid.cell(x + Vec<D>::Constant(range(i)));
  for (int k = 0; k < D; ++k) {  // whole blocks
    const std::int32_t count = grid.count(k), low = grid.boxes(k, own.low[k]) * count,
                       high = grid.boxes(k, own.high[k]) * count;
    own.low[k] -= (own.low[k] - low) % kCellsOfBlock;
    own.high[k] = high + std::min(((own.high[k] - high) / kCellsOfBlock + 1) * kCellsOfBlock, count) - 1;
  }
  for_each_block(i, [&](std::size_t at, const Image<D>& away, const Cell<D>& low, const Cell<D>& high) {
    for (const std::int32_t boxes : away) widest_ = std::max(widest_, std::abs(boxes));
    if (widest_ > packing_.largest()) throw_too_far();
    cells_.find_between(low, high, found_);
    for (const std::uint32_t each : found_) {
      const Slot j = packing_.slot(each);
      add(own.list, packing_.reversed(j, seen(packing_.pack(i, packing_.linear(away)), next_events_[j].where.cell)));
    }
    if (list_of_[at] == 0) {
      if (unused_lists_.empty()) {
        unused_lists_.push_back(static_cast<std::uint32_t>(lists_.size()));
        lists_.emplace_back();
      }
      list_of_[at] = unused_lists_.back();
      unused_lists_.pop_back();
    }
    auto& listed = lists_[list_of_[at]];
    meet(i, away, listed);
    listed.push_back(packing_.pack(i, packing_.linear(away)));
  });
}

/// A large sphere on the list of a block, as a small one sees it that is in the block.
template <int D>
std::uint32_t LargeSpheres<D>::seen(std::uint32_t listed, const CellPlace<D>& place) const {
  if (widest_ + cells_.widest() > packing_.largest()) [[unlikely]] {
    const Image<D> theirs = packing_.image(listed), own = packing_.image(packing_.pack(0, place.boxes));
    for (int k = 0; k < D; ++k)
      if (std::abs(theirs[k] - own[k]) > packing_.largest()) throw_too_far();
  }
  return packing_.pack(packing_.slot(listed), packing_.linear(listed) - place.boxes);
}

template <int D>
ScanTask LargeSpheres<D>::around(Slot i, const CellPlace<D>& place) {
  around_.clear();
  for (const std::uint32_t each : listed(place)) add(around_, seen(each, place));
  return around_.task(i, packing_.pack(i, 0));
}

template <int D>
ScanTask LargeSpheres<D>::pass(Slot i, const CellPlace<D>& from, const CellPlace<D>& to) {
  const auto only = [&](const CellPlace<D>& in, const CellPlace<D>& not_in, auto&& visit) {
    const auto& others = listed(not_in);
    for (const std::uint32_t each : listed(in)) {
      const std::uint32_t candidate = seen(each, in);
      if (std::ranges::none_of(others, [&](std::uint32_t other) { return seen(other, not_in) == candidate; }))
        visit(large_[number_[packing_.slot(each)]].list, candidate);
    }
  };
  around_.clear();
  only(from, to, [&](List& list, std::uint32_t candidate) { list.drop(packing_.reversed(i, candidate)); });
  only(to, from, [&](List& list, std::uint32_t candidate) {
    add(list, packing_.reversed(i, candidate));
    add(around_, candidate);
  });
  return around_.task(i, packing_.pack(i, 0));
}

template <int D>
void LargeSpheres<D>::enter(Slot i, const CellPlace<D>& place) {
  for (const std::uint32_t each : listed(place))
    add(large_[number_[packing_.slot(each)]].list, packing_.reversed(i, seen(each, place)));
}

template <int D>
void LargeSpheres<D>::leave(Slot i, const CellPlace<D>& place) {
  for (const std::uint32_t each : listed(place))
    large_[number_[packing_.slot(each)]].list.drop(packing_.reversed(i, seen(each, place)));
}

template <int D>
void LargeSpheres<D>::find_between(Cell<D> low, Cell<D> high, std::vector<std::uint32_t>& found) const {
  for (int k = 0; k < D; ++k)
    if (!cells_.grid().box().periodic(k)) {
      low[k] = std::max(low[k], 0);
      high[k] = std::min(high[k], cells_.grid().count(k) - 1);
    }
  const auto first = static_cast<std::ptrdiff_t>(found.size());
  CellPlace<D> place{};
  for_each_block(low, high, Vec<D>::Zero(), std::numeric_limits<double>::infinity(),
                 [&](std::size_t at, const Image<D>& away, const auto&...) {
                   place.boxes = packing_.linear(away);
                   for (const std::uint32_t each : lists_[list_of_[at]]) found.push_back(seen(each, place));
                 });
  std::sort(found.begin() + first, found.end());  // a region may have several of the blocks
  found.erase(std::unique(found.begin() + first, found.end()), found.end());
}

template class LargeSpheres<2>;
template class LargeSpheres<3>;

}  // namespace carom
