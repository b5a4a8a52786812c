// SPDX-License-Identifier: BSD-3-Clause
#include "engine/search/skin_lists.h"

#include <cmath>

namespace carom {

template <int D>
SkinLists<D>::SkinLists(const Box<D>& box, const FlowFrame& flow, const Packing<D>& packing, const ScanKernels& kernels,
                        std::span<const double> reach, bool equal, double largest, double skin,
                        PageVector<NextEvent<D>>& next_events)
    : box_(box),
      flow_(flow),
      packing_(packing),
      kernels_(kernels),
      reach_(reach),
      equal_(equal),
      largest_(largest),
      skin_(skin),
      next_events_(next_events),
      lists_(packing, next_events) {
  exact_ = !equal || !box.closed();
  if (!equal) level_.resize(reach.size());
}

template <int D>
std::uint8_t SkinLists<D>::octave(double largest, double reach) {
  return static_cast<std::uint8_t>(std::clamp(std::ilogb(largest / reach), 0, kOctaves - 1));
}

template <int D>
void SkinLists<D>::build(std::size_t n, const std::function<Vec<D>(Slot)>& place, const Extent<D>& extent,
                         double max_displacement) {
  // 1. Make the cells for each size.
  levels_.clear();
  widest_ = 0;
  std::array<std::size_t, kOctaves> members{};  // by octave
  std::array<double, kOctaves> largest_in{largest_};
  for (std::size_t i = 0; i < level_.size(); ++i) {
    const std::uint8_t o = level_[i] = octave(largest_, reach_[i]);
    ++members[o];
    largest_in[o] = std::max(largest_in[o], reach_[i]);
  }
  if (equal_) members[0] = n;
  std::array<std::uint8_t, kOctaves> levels{};
  std::vector<Vec<D>> places;  // empty if this is the whole system
  if (n < extent.particles)
    for (Slot i = 0; i < n; ++i) places.push_back(place(i));
  for (std::size_t o = 0; o < kOctaves; ++o) {
    if (o > 0 && members[o] == 0) continue;  // spheres admitted later go to larger ones
    const double largest = largest_in[o];
    levels[o] = static_cast<std::uint8_t>(levels_.size());
    const double all =
        static_cast<double>(members[o]) * static_cast<double>(extent.particles) / std::max(static_cast<double>(n), 1.0);
    const double farthest = largest_ + largest + 2 * (skin_ + max_displacement);
    levels_.push_back(
        {largest, RegionCells<D>(box_, packing_, kernels_, extent, all,
                                 flow_.widened(2 * (std::max(largest, 1e-300) + skin_)), flow_.widened(farthest))});
    RegionCells<D>& cells = levels_.back().cells;
    if (n < extent.particles) cells.confine(places);
    cells.clear();
    widen(cells.widest());
  }
  for (std::uint8_t& level : level_) level = levels[level];
  // 2. Insert every sphere into a cell.
  boxes_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const Vec<D> x = place(static_cast<Slot>(i));
    for (int k = 0; k < D; ++k) next_events_[i].where.centre[k] = x[k];
    insert(static_cast<Slot>(i), x);
  }
  // 3. Make the lists.
  lists_.clear(n);
  for (Slot i = 0; i < n; ++i) {
    next_events_[i].capacity = 0;
    lists_.assign(i, surround(i, centre(i)));
  }
}

template <int D>
void SkinLists<D>::widen(std::int32_t boxes) {
  widest_ = std::max(widest_, boxes);
  if (widest_ > packing_.largest()) throw_too_far();
}

template <int D>
void SkinLists<D>::insert(Slot i, const Vec<D>& x) {
  RegionCells<D>& cells = levels_[level_of(i)].cells;
  Image<D> boxes;
  if (!cells.insert(i, x, boxes)) {  // all cells are stored from now on
    for (const Slot j : cells.spread()) insert(j, centre(j));
    widen(cells.widest());
    cells.insert(i, x, boxes);
  }
  boxes_[i] = packing_.linear(boxes);
  for (const std::int32_t b : boxes)
    if (std::abs(b) > widest_) widen(std::abs(b));
}

/// The candidates of a sphere at x; valid until the next call.
template <int D>
std::span<const std::uint32_t> SkinLists<D>::surround(Slot i, const Vec<D>& x, double max_displacement) {
  unsigned found = 0;
  for (Level& level : levels_) look_into(level, i, x, max_displacement, found);
  return {found_.data(), found};
}

template <int D>
void SkinLists<D>::look_into(Level& level, Slot i, const Vec<D>& x, double max_displacement, unsigned& found) {
  const auto near = level.cells.find(x, reach(i) + level.largest_reach + 2 * (skin_ + max_displacement), flow_);
  const auto n = static_cast<unsigned>(near.slots.size());
  if (found_.size() < found + n + 8) found_.resize(std::size_t{2} * (found + n + 8));
  const std::int32_t carried = near.boxes;
  const bool far = (box_.tilt == 0 ? 2 : 3) * widest_ > packing_.largest();
  for (unsigned q = 0; q < n; ++q) {
    const Slot j = near.slots[q];
    if (far) {
      const Image<D> theirs = packing_.image(packing_.pack(0, boxes_[j])),
                     seen = packing_.image(packing_.pack(0, near.away[q] + carried));
      for (int k = 0; k < D; ++k)
        if (std::abs(theirs[k] - seen[k]) > packing_.largest()) throw_too_far();
    }
    const std::uint32_t candidate = packing_.pack(j, boxes_[j] - near.away[q] - carried);
    if (exact_) {
      const Vec<D> d = x - centre(j) + box_.shift(packing_.image(candidate));
      const double within = reach(i) + reach(j) + 2 * (skin_ + max_displacement);
      if (!(flow_.least_squared(d) < within * within)) continue;
    }
    found_[found] = candidate;
    found += j != i ? 1 : 0;
  }
}

template <int D>
std::span<const std::uint32_t> SkinLists<D>::renew(Slot i, const Vec<D>& x) {
  NextEvent<D>& a = next_events_[i];
  remove(i);
  for (int k = 0; k < D; ++k) a.where.centre[k] = x[k];
  insert(i, x);
  const std::span<const std::uint32_t> found = surround(i, x);
  const auto n = static_cast<unsigned>(found.size());
  if (fresh_.size() < n + 8) fresh_.resize(2 * n + 8);
  kept_.assign(a.count / 64 + 1u, 0);
  const std::uint32_t* const list = candidates(a);
  const unsigned fresh = kernels_.compare(list, a.count, found.data(), n, fresh_.data(), kept_.data());
  for (unsigned q = a.count; q-- > 0;) {  // from the end: the entry that moves to q has been checked
    if ((kept_[q / 64] >> (q % 64) & 1) != 0) continue;
    lists_.drop(packing_.slot(list[q]), packing_.reversed(i, list[q]));
    lists_.remove(i, q);
  }
  for (unsigned q = 0; q < fresh; ++q) {
    lists_.add(i, fresh_[q]);
    lists_.add(packing_.slot(fresh_[q]), packing_.reversed(i, fresh_[q]));
  }
  std::fill_n(fresh_.begin() + fresh, 8, packing_.pack(i, 0));
  return {fresh_.data(), fresh};
}

/// A sphere was moved by `boxes` boxes: moves its region along and corrects the images in the lists.
template <int D>
void SkinLists<D>::shift(Slot i, const Image<D>& boxes) {
  NextEvent<D>& a = next_events_[i];
  Eigen::Map<Vec<D>>(a.where.centre) += box_.shift(boxes);
  const std::int32_t linear = packing_.linear(boxes);
  boxes_[i] += linear;
  std::uint32_t* const list = lists_.of(a);
  for (unsigned q = 0; q < a.count; ++q) {
    const std::uint32_t old = list[q], own = packing_.reversed(i, old);
    const Slot j = packing_.slot(old);
    list[q] = packing_.pack(j, packing_.linear(old) - linear);
    NextEvent<D>& other = next_events_[j];
    std::uint32_t* const others = lists_.of(other);
    for (unsigned p = 0; p < other.count; ++p)
      if (others[p] == own) {
        others[p] = packing_.reversed(i, list[q]);
        lists_.divide(other);
        break;
      }
  }
  lists_.divide(a);
}

template <int D>
void SkinLists<D>::follow(std::span<const Record<D>> records) {
  for (Slot i = 0; i < records.size(); ++i) {
    const Image<D> boxes = box_.nearest_image(centre(i) - records[i].x);
    if (boxes != Image<D>{}) shift(i, boxes);
  }
  const double limit = skin_ * skin_ * 0.9;
  for (Slot i = 0; i < records.size(); ++i)
    if (!((records[i].x - centre(i)).squaredNorm() < limit)) renew(i, records[i].x);
}

template <int D>
void SkinLists<D>::admit(Slot i, const Vec<D>& x, std::span<const double> reach) {
  reach_ = reach;
  if (i == boxes_.size()) boxes_.push_back(0);
  if (!equal_) {
    if (i == level_.size()) level_.push_back(0);
    // The smallest level that can hold the sphere: its octave may have none.
    const auto level =
        std::find_if(levels_.rbegin(), levels_.rend(), [&](const Level& l) { return l.largest_reach >= reach[i]; });
    level_[i] = static_cast<std::uint8_t>(levels_.rend() - level - 1);
  }
  for (int k = 0; k < D; ++k) next_events_[i].where.centre[k] = x[k];
  next_events_[i].count = next_events_[i].same = 0;
  insert(i, x);
  const std::span<const std::uint32_t> list = surround(i, x);
  lists_.assign(i, list);
  for (const std::uint32_t candidate : list) lists_.add(packing_.slot(candidate), packing_.reversed(i, candidate));
}

template <int D>
void SkinLists<D>::dismiss(Slot i) {
  NextEvent<D>& a = next_events_[i];
  remove(i);
  const std::uint32_t* const list = candidates(a);
  for (unsigned q = 0; q < a.count; ++q) lists_.drop(packing_.slot(list[q]), packing_.reversed(i, list[q]));
  lists_.assign(i, {});
}

template <int D>
bool SkinLists<D>::move(Slot i, const Vec<D>& x, double room, double now) {
  const double limit = room * (1 - 1e-6);
  Vec<D> d = x - centre(i);
  d[0] += flow_.strain(now) * d[1];
  if (d.squaredNorm() < limit * limit) return false;
  renew(i, x);
  return true;
}

template <int D>
std::span<const std::uint32_t> SkinLists<D>::find_near(Slot i, double max_displacement) {
  return surround(i, centre(i), max_displacement);
}

template class SkinLists<2>;
template class SkinLists<3>;

}  // namespace carom
