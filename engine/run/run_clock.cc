// SPDX-License-Identifier: BSD-3-Clause
#include "engine/run/run_clock.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "engine/base/elementary.h"
#include "engine/base/error.h"
#include "engine/run/simulation.h"

namespace carom {
namespace {

/// The longest epoch of a gas that has cooled, in steps: a gas slower than this is at rest to the rounding of
/// positions.
constexpr double kLongestEpoch = 1e9;

/// The rate of contacts is known to an eighth from this number. It is that of the last contacts or, in a system that
/// has more in a slab, of the last slab.
constexpr double kContactsOfRate = 64;

/// The mean free times for which contacts are expected as in a gas: a crystal that melts has its first contacts later.
/// Where forces keep spheres apart, contacts stay rarer, and fixed steps need not be divided.
constexpr double kFreeTimes = 2;

/// Fewer contacts in a slab cost nothing that matters, however few spheres have them.
constexpr double kFewContacts = 32;

/// A slab is repeated if it has this many times the contacts that are wanted; its first flight is lost then. Contacts
/// make no slab shorter than this part of a step: contacts that repeat without end are an error of their own.
constexpr double kTooMany = 2, kShortestPart = 0x1p-6;

/// The largest change of the length from slab to slab: an acceleration that happens not to change says nothing about
/// the next step.
constexpr double kMostGrowth = 2, kMostShrinkage = 0.25;

/// The largest power of 2^(1/4) that is not above a positive number: with few lengths, most steps have equal lengths,
/// and the extrapolation of accelerations is good.
double rounded_down(double length) {
  int exponent = 0;
  const double mantissa = std::frexp(length, &exponent);  // from 0.5 to 1
  for (const double power : {0x1.ae89f995ad3adp-1, 0x1.6a09e667f3bcdp-1, 0x1.306fe0a31b715p-1})
    if (mantissa >= power) return std::ldexp(power, exponent);
  return std::ldexp(0.5, exponent);
}

}  // namespace

RunClock::RunClock(const Plan& plan, bool stepping, std::size_t particles)
    : plan_(plan),
      stepping_(stepping),
      particles_(static_cast<double>(std::max<std::size_t>(1, particles))),
      most_collisions_(std::max<std::uint64_t>(500'000, 4 * particles)) {}

double RunClock::time_after(std::int64_t steps) const {
  return count.time + static_cast<double>(steps - count.steps) * step();
}

double RunClock::length_from(double start) const {
  const double left = plan_.end_time.value_or(std::numeric_limits<double>::infinity()) - start;
  return left < step() - plan_.end_slack() ? left : step();
}

bool RunClock::adapts() const { return plan_.accuracy > 0; }

/// The length of a step, unless an end makes it shorter.
double RunClock::step() const { return adapts() && pace.length > 0 ? pace.length : plan_.step; }

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
  slab.accuracy = plan_.accuracy;
  if (!adapts() && pace.length > 0) {
    const double parts = std::min(1 / kShortestPart, std::ceil((1 - 1e-9) * slab.length / pace.length));
    slab.ends_step = !(parts > 1);
    if (!slab.ends_step) slab.length /= parts;
  }
  if (slab.length > std::max(kShortestPart * plan_.step, plan_.shortest_step))
    slab.most_contacts = kTooMany * most_contacts_;
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
      !cut_ && whole_ && s.end_time == next.start &&
      (adapts() || s.steps == s.start_steps || count.within > 0 || length_from(time_after(s.steps - 1)) == plan_.step);
  if (!whole) return false;
  if (finished(s) || next.steps < count.stride || length_from(time_after(s.steps)) != step()) return true;
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
  if (adapts()) {
    const double end = slab.start + slab.length;
    ++s.steps;
    s.end_time = plan_.end_time && *plan_.end_time - end <= plan_.end_slack() ? *plan_.end_time : end;
    count = {.steps = s.steps, .time = s.end_time, .first_speed = count.first_speed};
    return slab.length;
  }
  const double step = length_from(time_after(slab.index));
  if (reached < slab.length || !slab.ends_step) {
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

void RunClock::expect(double most_contacts, double contacts, double longest) {
  most_contacts_ = std::max(most_contacts * particles_, kFewContacts);
  pace = {.expected = contacts, .before = kFreeTimes / contacts};
  const double length = std::min(length_with_contacts(), longest);
  pace.length = std::isfinite(length) ? length : 0;
}

/// The length of a slab with as many contacts as are wanted; infinite without contacts. In a crystal that melts, the
/// first slabs have few.
double RunClock::length_with_contacts() const {
  const double rate = pace.time > 0 ? pace.contacts / pace.time : 0;
  return most_contacts_ / std::max(rate, particles_ * pace.expected);
}

void RunClock::adapt(const Slab& slab, const LocalError& error, std::uint64_t contacts, double longest) {
  const auto happened = static_cast<double>(contacts);
  const double kept = std::min(1.0, kContactsOfRate / (pace.contacts + happened));
  pace.contacts = kept * pace.contacts + happened;
  pace.time = kept * pace.time + slab.length;
  if (pace.before -= slab.length; !(pace.before > 0)) pace.expected = pace.before = 0;
  double length = length_with_contacts();
  if (!adapts()) {
    pace.length = std::isfinite(length) ? length : 0;
    return;
  }
  whole_ = !(slab.length < pace.length);
  const double accurate = error.rate > 0 ? std::min(longest, elementary::cbrt(plan_.accuracy / error.rate)) : longest;
  length = std::clamp(length, kShortestPart * accurate, accurate);
  length = std::clamp(length, kMostShrinkage * pace.length, kMostGrowth * pace.length);
  pace.length = std::max(rounded_down(std::min(length, longest)), plan_.shortest_step);
}

void RunClock::shorten(const Slab& slab, const StepTooLong& wanted) {
  const double length = std::max(wanted.length, plan_.shortest_step);
  if (!(length < slab.length) || !(slab.start + length > slab.start))
    throw Error(Failure::numerical,
                "a step of " + short_text(slab.length) +
                    (wanted.id ? " changes the acceleration of particle " + std::to_string(*wanted.id) +
                                     " too much for an accuracy of " + short_text(plan_.accuracy)
                               : std::string(" is too long for the forces, which are not finite or far too stiff")) +
                    (length < slab.length
                         ? ", and a shorter one does not change the time; give a larger integrator.accuracy"
                         : ", and shortest_step allows no shorter one; give a shorter integrator.shortest_step, or a "
                           "larger integrator.accuracy"));
  pace.length = length;
}

void RunClock::go_on(const Statistics& s) {
  if (std::abs(s.end_time - next_slab(s).start) <= plan_.end_slack()) return;
  count.steps = s.steps;
  count.time = s.end_time;
  count.within = count.boxes = 0;
  count.contacts = 0;
}

}  // namespace carom
