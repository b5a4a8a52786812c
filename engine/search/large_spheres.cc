// SPDX-License-Identifier: BSD-3-Clause
#include "engine/search/large_spheres.h"

#include <algorithm>

namespace carom {

template <int D>
LargeSpheres<D>::LargeSpheres(const LinkedCells<D>& cells, const Packing<D>& packing, std::span<const double> reach,
                              double small, double skin, PageVector<NextEvent<D>>& next_events)
    : cells_(cells),
      packing_(packing),
      reach_(reach),
      small_(std::max(small, 0.0)),
      skin_(skin),
      next_events_(next_events),
      number_(reach.size(), kSmall),
      candidates_(64) {
  std::size_t all = 1;
  for (int k = 0; k < D; ++k) {
    blocks_[k] = static_cast<std::size_t>((cells.grid().count(k) + kCellsOfBlock - 1) / kCellsOfBlock);
    all *= blocks_[k];
  }
  listed_.resize(all);
  for (Slot i = 0; i < reach.size(); ++i)
    if (reach[i] > small) number_[i] = static_cast<std::uint32_t>(large_.size()), large_.push_back({{}, {}, {}});
  for (Large& each : large_) each.low[0] = 0, each.high[0] = -1;  // no region yet
}

/// Calls visit(block, away) for each block of a region, with the box in which it is.
template <int D>
template <class Visit>
void LargeSpheres<D>::for_each_block(const Large& large, Visit&& visit) const {
  Image<D> away{};
  const auto along = [&](const auto& self, int axis, std::size_t before) -> void {
    const CellGrid<D>& grid = cells_.grid();
    const std::int32_t count = grid.count(axis);
    for (std::int32_t c = large.low[axis], end; c <= large.high[axis]; c = end) {
      away[axis] = grid.boxes(axis, c);
      const std::int32_t first = away[axis] * count, number = (c - first) / kCellsOfBlock;
      end = first + std::min((number + 1) * kCellsOfBlock, count);
      const std::size_t at = before * blocks_[axis] + static_cast<std::size_t>(number);
      if (axis == D - 1)
        visit(at, away);
      else
        self(self, axis + 1, at);
    }
  };
  along(along, 0, 0);
}

/// Adds the listed large spheres that may touch a large one, as seen from its box, unless it has them already.
template <int D>
void LargeSpheres<D>::find(Slot i, const Image<D>& away, std::span<const std::uint32_t> listed,
                           std::vector<std::uint32_t>& found) const {
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
    if (d.squaredNorm() < within * within && std::ranges::find(found, candidate) == found.end())
      found.push_back(candidate);
  }
}

template <int D>
void LargeSpheres<D>::renew(Slot i, const Vec<D>& x) {
  Large& own = large_[number_[i]];
  for (const std::uint32_t other : own.near)
    std::erase(large_[number_[packing_.slot(other)]].near, packing_.reversed(i, other));
  own.near.clear();
  for_each_block(own, [&](std::size_t at, const Image<D>&) {
    std::erase_if(listed_[at], [&](std::uint32_t each) { return packing_.slot(each) == i; });
  });

  for (int k = 0; k < D; ++k) next_events_[i].where.centre[k] = x[k];
  const Vec<D> reach = Vec<D>::Constant((reach_[i] + small_ + skin_) * (1 + 1e-9));
  const CellGrid<D>& grid = cells_.grid();
  own.low = grid.cell(x - reach);
  own.high = grid.cell(x + reach);
  for (int k = 0; k < D; ++k) {  // whole blocks
    const std::int32_t count = grid.count(k), low = grid.boxes(k, own.low[k]) * count,
                       high = grid.boxes(k, own.high[k]) * count;
    own.low[k] -= (own.low[k] - low) % kCellsOfBlock;
    own.high[k] = high + std::min(((own.high[k] - high) / kCellsOfBlock + 1) * kCellsOfBlock, count) - 1;
  }
  for_each_block(own, [&](std::size_t at, const Image<D>& away) {
    find(i, away, listed_[at], own.near);
    for (const std::int32_t boxes : away) widest_ = std::max(widest_, std::abs(boxes));
    if (widest_ > packing_.largest()) throw_too_far();
    listed_[at].push_back(packing_.pack(i, packing_.linear(away)));
  });
  for (const std::uint32_t other : own.near)
    large_[number_[packing_.slot(other)]].near.push_back(packing_.reversed(i, other));
}

template <int D>
void LargeSpheres<D>::add(std::uint32_t candidate) {
  candidates_[count_] = candidate;
  if (packing_.linear(candidate) == 0) std::swap(candidates_[count_], candidates_[same_++]);
  ++count_;
}

template <int D>
ScanTask LargeSpheres<D>::task(Slot i) {
  std::fill_n(candidates_.begin() + count_, kPadding, packing_.pack(i, 0));
  return {i, candidates_.data(), std::exchange(count_, 0), std::exchange(same_, 0)};
}

template <int D>
ScanTask LargeSpheres<D>::around(Slot i, const CellPlace<D>& place) {
  const std::vector<std::uint32_t>& listed = listed_[block(place)];
  if (candidates_.size() < listed.size() + kPadding) candidates_.resize(2 * (listed.size() + kPadding));
  for (const std::uint32_t each : listed) {
    if (widest_ + cells_.widest() > packing_.largest()) [[unlikely]] {
      const Image<D> theirs = packing_.image(each), own = packing_.image(packing_.pack(0, place.boxes));
      for (int k = 0; k < D; ++k)
        if (std::abs(theirs[k] - own[k]) > packing_.largest()) throw_too_far();
    }
    add(packing_.pack(packing_.slot(each), packing_.linear(each) - place.boxes));
  }
  return task(i);
}

/// Checks every small candidate, because spheres have moved so many boxes that a difference of images may overflow.
template <int D>
void LargeSpheres<D>::check(Slot i, std::span<const std::uint32_t> found) const {
  const Large& own = large_[number_[i]];
  for (const std::uint32_t each : found) {
    const Image<D> theirs = packing_.image(packing_.pack(0, next_events_[packing_.slot(each)].where.cell.boxes));
    for (int k = 0; k < D; ++k)
      for (const std::int32_t c : {own.low[k], own.high[k]})
        if (std::abs(theirs[k] - cells_.grid().boxes(k, c)) > packing_.largest()) throw_too_far();
  }
}

template <int D>
ScanTask LargeSpheres<D>::around(Slot i) {
  const Large& own = large_[number_[i]];
  cells_.find_between(own.low, own.high, found_);
  const std::size_t all = found_.size() + own.near.size();
  if (candidates_.size() < all + kPadding) candidates_.resize(2 * (all + kPadding));
  if (widest_ + cells_.widest() > packing_.largest()) [[unlikely]]
    check(i, found_);
  for (const std::uint32_t each : found_) add(each);
  for (const std::uint32_t each : own.near) add(each);
  return task(i);
}

template class LargeSpheres<2>;
template class LargeSpheres<3>;

}  // namespace carom
