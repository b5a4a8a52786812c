// SPDX-License-Identifier: BSD-3-Clause
#include "engine/run/run_clock.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "engine/run/simulation.h"

namespace carom {
namespace {

/// The longest epoch of a gas that has cooled, in steps: a gas slower than this is at rest to the rounding of
/// positions.
constexpr double kLongestEpoch = 1e9;

}  // namespace

RunClock::RunClock(const Plan& plan, bool stepping, std::size_t particles)
    : plan_(plan), stepping_(stepping), most_collisions_(std::max<std::uint64_t>(500'000, 4 * particles)) {}

double RunClock::time_after(std::int64_t steps) const {
  return count.time + static_cast<double>(steps - count.steps) * plan_.step;
}

double RunClock::length_from(double start) const {
  const double left = plan_.end_time.value_or(std::numeric_limits<double>::infinity()) - start;
  return left < plan_.step - plan_.end_slack() ? left : plan_.step;
}

Slab RunClock::next_slab(const Statistics& s) const {
  Slab slab;
  slab.index = s.steps;
  slab.start = time_after(slab.index) + count.within;
  slab.steps = count.stride;
  if (plan_.steps) slab.steps = std::min(slab.steps, *plan_.steps - slab.index);
  if (plan_.end_time) {
    const double left = *plan_.end_time - plan_.end_slack() - time_after(slab.index);
    slab.steps = static_cast<std::int64_t>(std::min(static_cast<double>(slab.steps), left / plan_.step));
  }
  slab.steps = std::max<std::int64_t>(slab.steps, 1);
  const double length =
      slab.steps == 1 ? length_from(time_after(slab.index)) : static_cast<double>(slab.steps) * plan_.step;
  slab.length = length - count.within;
  if (!stepping_) {
    slab.contact_limit = 2 * most_collisions_;
    slab.collision_limit =
        std::min(s.counters.sphere_sphere + most_collisions_, plan_.collisions.value_or(slab.collision_limit));
  }
  return slab;
}

bool RunClock::finished(const Statistics& s) const {
  return (plan_.steps && s.steps >= *plan_.steps) ||
         (plan_.end_time && s.end_time >= *plan_.end_time - plan_.end_slack()) ||
         (plan_.collisions && s.counters.sphere_sphere >= *plan_.collisions);
}

double RunClock::fraction_done(const Statistics& s) const {
  double done = 0;
  if (plan_.steps)
    done = std::max(done,
                    static_cast<double>(s.steps - s.start_steps) / static_cast<double>(*plan_.steps - s.start_steps));
  if (plan_.end_time) done = std::max(done, (s.end_time - s.start_time) / (*plan_.end_time - s.start_time));
  if (plan_.collisions)
    done = std::max(done, static_cast<double>(s.counters.sphere_sphere) / static_cast<double>(*plan_.collisions));
  return done;
}

bool RunClock::is_last_on_the_way(const Statistics& s) const {
  const Slab next = next_slab(s);
  // A slab that meets an end may differ from a step by rounding alone.
  const bool whole =
      !cut_ && s.end_time == next.start &&
      (s.steps == s.start_steps || count.within > 0 || length_from(time_after(s.steps - 1)) == plan_.step);
  if (!whole) return false;
  if (finished(s) || next.steps < count.stride || length_from(time_after(s.steps)) != plan_.step) return true;
  // Free flight ends within a slab at its last collision; the slab before predicts the number of collisions.
  return plan_.collisions && next.collision_limit == *plan_.collisions &&
         (!last_collisions_ || s.counters.sphere_sphere + 2 * *last_collisions_ + 1000 >= *plan_.collisions);
}

double RunClock::end_slab(const Slab& slab, double reached, std::uint64_t pairs, std::uint64_t walls, double boxes,
                          Statistics& s) {
  last_collisions_ = pairs;
  cut_ = slab.steps < count.stride;
  count.contacts += 2 * pairs + walls;
  count.boxes = std::max(count.boxes, boxes);
  const double step = length_from(time_after(slab.index));
  if (reached < slab.length) {
    const double within = count.within + reached;
    s.end_time = time_after(slab.index) + within;
    if (finished(s))
      ++s.steps;  // the run ends inside this epoch, at its last collision; the begun epoch counts as a step
    else
      count.within = within;
    return 0;
  }
  s.steps += slab.steps;
  s.end_time = step == plan_.step ? time_after(s.steps) : *plan_.end_time;
  return std::exchange(count.within, 0) + slab.length;
}

double RunClock::most_steps() const { return stepping_ ? std::floor(plan_.longest_step / plan_.step) : kLongestEpoch; }

void RunClock::lengthen(double steps) {
  const auto before = count.stride;
  count.stride = static_cast<std::int64_t>(std::min(steps, most_steps()));
  if (count.stride > before) *last_collisions_ *= static_cast<std::uint64_t>(count.stride / before + 1);
  count.contacts = 0;
  count.boxes = 0;
}

void RunClock::go_on(const Statistics& s) {
  if (std::abs(s.end_time - next_slab(s).start) <= plan_.end_slack()) return;
  count.steps = s.steps;
  count.time = s.end_time;
  count.within = count.boxes = 0;
  count.contacts = 0;
}

}  // namespace carom
