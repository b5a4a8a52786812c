#include "engine/division.h"

#include <algorithm>

namespace carom {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

}  // namespace

template <int D>
Division<D>::Division(const Box<D>& box, std::span<const Vec<D>> x, std::size_t regions, double reach)
    : box_(box), reach_(reach) {
  Part all;
  for (int k = 0; k < D; ++k) {
    all.low[k] = box.periodic(k) ? 0 : -kInfinite;
    all.high[k] = box.periodic(k) ? box.edges[k] : kInfinite;
  }
  std::vector<Vec<D>> places(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) places[i] = wrapped(x[i]);
  root_ = divide(places, all, std::max<std::size_t>(regions, 1));
  for (std::uint32_t r = 0; r < parts_.size(); ++r) neighbours_.push_back(neighbours_of(r));
}

/// Cuts a part across its longest edge; returns the cut, or the complement of the region's number.
template <int D>
std::int32_t Division<D>::divide(std::span<Vec<D>> x, Part part, std::size_t regions) {
  if (regions == 1) {
    part.centre = 0.5 * (part.low + part.high);
    part.half = 0.5 * (part.high - part.low);
    for (int k = 0; k < D; ++k)
      part.whole[k] = box_.periodic(k) ? part.low[k] == 0 && part.high[k] == box_.edges[k]
                                       : !std::isfinite(part.low[k]) && !std::isfinite(part.high[k]);
    parts_.push_back(part);
    return ~static_cast<std::int32_t>(parts_.size() - 1);
  }
  Vec<D> low = box_.edges, high = Vec<D>::Zero();  // of the spheres in it
  for (const Vec<D>& place : x) low = low.cwiseMin(place).eval(), high = high.cwiseMax(place).eval();
  int axis = 0;
  for (int k = 0; k < D; ++k) {
    if (std::isfinite(part.low[k])) low[k] = part.low[k];
    if (std::isfinite(part.high[k])) high[k] = part.high[k];
    if (high[k] - low[k] > high[axis] - low[axis]) axis = k;
  }
  const std::size_t below = regions / 2, split = x.size() * below / regions;
  double at = low[axis] + (high[axis] - low[axis]) * static_cast<double>(below) / static_cast<double>(regions);
  if (split < x.size()) {
    std::nth_element(x.begin(), x.begin() + static_cast<std::ptrdiff_t>(split), x.end(),
                     [&](const Vec<D>& a, const Vec<D>& b) { return a[axis] < b[axis]; });
    // Between two layers, where there are layers: spheres of one that is cut would soon stand on one side of it.
    const double upper = x[split][axis];
    double lower = -kInfinite;
    for (std::size_t i = 0; i < split; ++i)
      if (x[i][axis] < upper) lower = std::max(lower, x[i][axis]);
    at = std::isfinite(lower) ? 0.5 * (lower + upper) : upper;
  }
  const auto middle = std::partition(x.begin(), x.end(), [&](const Vec<D>& place) { return place[axis] < at; });
  const auto number = static_cast<std::int32_t>(cuts_.size());
  cuts_.push_back({axis, at, 0, 0});
  Part lower = part, upper = part;
  lower.high[axis] = upper.low[axis] = at;
  const std::int32_t first = divide({x.begin(), middle}, lower, below);
  const std::int32_t second = divide({middle, x.end()}, upper, regions - below);
  cuts_[static_cast<std::size_t>(number)].below = first;
  cuts_[static_cast<std::size_t>(number)].above = second;
  return number;
}

template <int D>
std::uint32_t Division<D>::owner(const Vec<D>& at) const {
  std::int32_t node = root_;
  while (node >= 0) {
    const Cut& cut = cuts_[static_cast<std::size_t>(node)];
    node = at[cut.axis] < cut.at ? cut.below : cut.above;
  }
  return static_cast<std::uint32_t>(~node);
}

template <int D>
bool Division<D>::clip(std::uint32_t region, double margin, Vec<D>& low, Vec<D>& high) const {
  const Part& part = parts_[region];
  for (int k = 0; k < D; ++k) {
    const double edge = box_.edges[k];
    const bool images = box_.periodic(k);
    if (part.whole[k] || (images && high[k] - low[k] > edge)) continue;
    double least = kInfinite, most = -kInfinite;
    for (int box = images ? -1 : 0; box <= (images ? 1 : 0); ++box) {
      const double from = std::max(low[k], part.low[k] - margin + box * edge);
      const double to = std::min(high[k], part.high[k] + margin + box * edge);
      if (from <= to) least = std::min(least, from), most = std::max(most, to);
    }
    if (!(least <= most)) return false;
    low[k] = least;
    high[k] = most;
  }
  return true;
}

/// Between two stretches of an axis.
template <int D>
double Division<D>::gap(int axis, double low, double high, double other_low, double other_high) const {
  const double edge = box_.edges[axis];
  double least = std::max({low - other_high, other_low - high, 0.0});
  if (box_.periodic(axis)) {
    least = std::min(least, std::max({low - (other_high - edge), (other_low - edge) - high, 0.0}));
    least = std::min(least, std::max({low - (other_high + edge), (other_low + edge) - high, 0.0}));
  }
  return least;
}

template <int D>
std::vector<std::uint32_t> Division<D>::neighbours_of(std::uint32_t region) const {
  std::vector<std::uint32_t> near;
  const Part& a = parts_[region];
  for (std::uint32_t r = 0; r < parts_.size(); ++r) {
    const Part& b = parts_[r];
    double sum = 0;
    for (int k = 0; k < D; ++k) {
      const double d = gap(k, a.low[k], a.high[k], b.low[k], b.high[k]);
      sum += d * d;
    }
    if (r != region && sum <= reach_ * reach_) near.push_back(r);
  }
  return near;
}

template class Division<2>;
template class Division<3>;

}  // namespace carom
