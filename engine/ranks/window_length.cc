// SPDX-License-Identifier: BSD-3-Clause
#include "engine/ranks/window_length.h"

#include <algorithm>
#include <cmath>

#include "engine/search/search_tuning.h"

namespace carom {
namespace {

// Mean collisions of a sphere in a window. Short windows need fewer ghosts and repairs, and a log that stays in the
// cache; long ones fewer searches of borders and fewer waits. At packing fraction 0.30 a rank of two with 32,000
// spheres executes 894.6, 883.3 and 884.4 million instructions in 1.6·10⁵ collisions with 0.3, 0.15 and 0.1;
// at 0.10, 1194.5 with 0.3 and 1139.2 with 0.15.
constexpr double kCollisionsPerWindow = 0.15;
constexpr double kMaxDisplacement = 1.0, kMinDisplacement = 0.02;  // [largest diameter]
// Speed allowed for, relative to the largest speed so far. A window with a faster sphere is revoked, and all subdomains
// are loaded again. The fastest of 10⁴ or 10⁶ spheres in equilibrium has 4.6 or 5.5 times the thermal speed along an
// axis, and a sphere leaves a collision 1.25 times as fast as this with a probability of 3e-7 or 2e-10: once in 300 or
// 4500 collisions per sphere. With a factor of 1.15 it would be once in 26 or 120.
constexpr double kSpeedAllowance = 1.25;

/// The velocity of a sphere relative to the flow.
template <int D>
Vec<D> relative_velocity(const Box<D>& box, const Particles<D>& block, Id i) {
  Vec<D> v = block.v[i];
  v[0] -= box.flow(block.x[i]);
  return v;
}

/// The time in which a sphere has kCollisionsPerWindow collisions, by Enskog's theory, if the spheres fill the box.
template <int D>
double first_pace(const Box<D>& box, const Sizes& sizes, Communicator& ranks, const Particles<D>& block) {
  ExactSum squares;  // exact, so that it does not depend on the number of ranks
  for (Id i = 0; i < block.v.size(); ++i) squares.add(relative_velocity(box, block, i).squaredNorm());
  const double thermal = std::sqrt(sum_of_all(ranks, squares).value() / static_cast<double>(D * sizes.spheres));
  const Extent<D> all(sizes.spheres, Vec<D>::Zero(), box.edges);
  return kCollisionsPerWindow / (contacts_a_length(situation_of<D>(box, sizes.radius, all, sizes.number)) * thermal);
}

}  // namespace

template <int D>
void WindowLength<D>::start(const Box<D>& box, const Sizes& sizes, Communicator& ranks, const Particles<D>& block,
                            const Vec<D>& g, double horizon) {
  each_ = 0.5 * kCollisionsPerWindow * static_cast<double>(sizes.spheres);
  field_ = g.norm() * horizon;
  fastest_ = 0;
  if (box.sheared()) {
    longest_ = kStrainOfWindow / std::abs(box.shear_rate);
    // Free flight at a strain e after an event, by the largest singular value of the shear; and the window itself.
    const double e = 0.5 * std::abs(box.shear_rate) * horizon;
    stretch_ = (1 + kStrainOfWindow) * (e + std::sqrt(1 + e * e));
  }
  for (Id i = 0; i < block.v.size(); ++i) fastest_ = std::max(fastest_, relative_velocity(box, block, i).norm());
  ranks.largest({&fastest_, 1});
  if (pace_ == 0 && fastest_ > 0) pace_ = first_pace(box, sizes, ranks, block);
  fastest_ = kSpeedAllowance * stretch_ * fastest_ + field_;
  max_displacement_ = std::clamp(fastest_ > 0 ? 1.05 * pace_ * fastest_ : 0, kMinDisplacement * diameter_,
                                 kMaxDisplacement * diameter_);
}

template <int D>
double WindowLength<D>::window_end(double now, double end, double collisions) const {
  double length = fastest_ > 0 ? max_displacement_ / fastest_ : end - now;
  if (pace_ > 0) length = std::min({length, pace_, (0.1 + std::max(collisions, 0.0) / each_) * pace_});
  length = std::min(length, longest_);
  if (forced_) length = std::min(length, forced_());
  const double windows = std::ceil((end - now) / length * (1 - 1e-9));
  return windows <= 1 ? end : now + (end - now) / windows;
}

template <int D>
void WindowLength<D>::allow_for(double speed) {
  fastest_ = std::max(fastest_, kSpeedAllowance * stretch_ * speed + field_);
}

template <int D>
void WindowLength<D>::note(double length, std::uint64_t collisions) {
  // The mean of rates: the times of windows with few collisions have no bound.
  pace_ = 1 / (0.9 / pace_ + 0.1 * static_cast<double>(collisions) / (each_ * length));
}

template class WindowLength<2>;
template class WindowLength<3>;

}  // namespace carom
