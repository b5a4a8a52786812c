// SPDX-License-Identifier: BSD-3-Clause
#include "engine/ranks/window_length.h"

#include <algorithm>
#include <cmath>

namespace carom {
namespace {

constexpr double kCollisions = 0.3;                                   // of a sphere in a window, about
constexpr double kMostDisplacement = 1.0, kLeastDisplacement = 0.02;  // in diameters
constexpr double kSpeedFactor = 1.15;  // factor between the largest speed and the one allowed for

/// The time in which a sphere collides kCollisions times, by Enskog's theory.
template <int D>
double first_pace(const Box<D>& box, const Sizes& sizes, Communicator& ranks, const Particles<D>& block) {
  ExactSum squares;  // the same for any number of ranks
  Extent<D> extent;
  for (const Vec<D>& v : block.v) squares.add(v.squaredNorm());
  for (const Vec<D>& x : block.x) extent.add(x);
  std::vector<double> bounds;
  for (int k = 0; k < D; ++k) {
    bounds.push_back(extent.particles > 0 ? -extent.low[k] : -std::numeric_limits<double>::infinity());
    bounds.push_back(extent.particles > 0 ? extent.high[k] : -std::numeric_limits<double>::infinity());
  }
  ranks.largest(bounds);
  for (int k = 0; k < D; ++k)
    extent.low[k] = -bounds[std::size_t{2} * k], extent.high[k] = bounds[std::size_t{2} * k + 1];
  extent.particles = sizes.spheres;
  const double thermal = std::sqrt(sum_of_all(ranks, squares).value() / static_cast<double>(D * sizes.spheres));
  return kCollisions / (contacts_a_length(situation_of<D>(box, sizes.radius, extent, sizes.number)) * thermal);
}

}  // namespace

template <int D>
void WindowLength<D>::start(const Box<D>& box, const Sizes& sizes, Communicator& ranks, const Particles<D>& block,
                            const Vec<D>& g, double horizon) {
  field_ = g.norm() * horizon;
  fastest_ = 0;
  for (const Vec<D>& v : block.v) fastest_ = std::max(fastest_, v.norm());
  ranks.largest({&fastest_, 1});
  if (pace_ == 0 && fastest_ > 0) pace_ = first_pace(box, sizes, ranks, block);
  fastest_ = kSpeedFactor * fastest_ + field_;
  max_displacement_ =
      std::clamp(1.05 * pace_ * fastest_, kLeastDisplacement * diameter_, kMostDisplacement * diameter_);
}

template <int D>
double WindowLength<D>::window_end(double now, double end) const {
  double length = fastest_ > 0 ? max_displacement_ / fastest_ : end - now;
  if (pace_ > 0) length = std::min(length, pace_);
  if (forced_) length = std::min(length, forced_());
  const double windows = std::ceil((end - now) / length * (1 - 1e-9));
  return windows <= 1 ? end : now + (end - now) / windows;
}

template <int D>
double WindowLength<D>::first_beyond(Subdomain<D>* subdomain, double now, double end, Communicator& ranks) {
  double speed = 0, first = std::numeric_limits<double>::infinity();
  if (subdomain) speed = subdomain->fastest() + field_;
  if (subdomain && speed > fastest_)
    subdomain->for_each_touched([&](Slot i) { first = std::min(first, beyond_at(*subdomain, i, now, end)); });
  std::array<double, 2> worst{speed, -first};
  ranks.largest(worst);
  if (worst[0] > fastest_) fastest_ = kSpeedFactor * worst[0];
  return -worst[1];
}

/// The same of one sphere, by the length of its path.
template <int D>
double WindowLength<D>::beyond_at(Subdomain<D>& subdomain, Slot i, double now, double end) const {
  const auto path = subdomain.path(i);
  double left = max_displacement_;
  for (std::size_t k = 0; k <= path.size(); ++k) {
    const double speed = subdomain.before(i, k).v.norm() + field_;
    const double until = k < path.size() ? path[k].key.time : end;
    if (speed * (until - now) > left) return now + left / speed;
    left -= speed * (until - now);
    now = until;
  }
  return std::numeric_limits<double>::infinity();
}

template <int D>
void WindowLength<D>::note(double length, std::uint64_t collisions, std::size_t spheres) {
  if (collisions == 0) return;
  const double pace = length * kCollisions * static_cast<double>(spheres) / (2 * static_cast<double>(collisions));
  pace_ = pace_ > 0 ? 0.9 * pace_ + 0.1 * pace : pace;
}

template class WindowLength<2>;
template class WindowLength<3>;

}  // namespace carom
