// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The clock of a run: which slab comes next, what time it is after it, and whether the run has ended. It knows the plan
// and what has been counted, and nothing of the particles.
//
// Step n ends at a whole multiple of the step after the origin of the count, so that rounding does not accumulate. The
// last step may be shortened to end at Plan::end_time. An epoch of free flight may need several slabs, and may be as
// long as several steps. With Plan::accuracy each step has a length of its own (Pace), and the count starts anew after
// each step. A step of fixed length has several slabs if one would have too many contacts.

#include <cstdint>
#include <limits>
#include <optional>

#include "engine/integrators/integrator.h"

namespace carom {

struct Plan;
struct Statistics;

/// Where the clock counts from, and how far it is in the present epoch. When `steps` steps were complete, the time was
/// `time`; n steps are complete at time + (n − steps) · Plan::step.
struct StepCount {
  std::int64_t steps = 0;
  double time = 0;
  /// How far an epoch of free flight that needs several slabs has advanced [time].
  double within = 0;
  // What happened in the epoch so far:
  double boxes = 0;            ///< PastEpoch::boxes
  std::uint64_t contacts = 0;  ///< a contact of two spheres counts twice
  /// Free flight with contacts that dissipate: if the gas is k times slower than at the start, an epoch has k steps.
  double first_speed = 0;   ///< thermal speed at the start [length/time]
  std::int64_t stride = 1;  ///< steps of the next slab
};

/// The lengths of slabs of methods that adapt.
struct Pace {
  double length = 0;  ///< the longest of the next slab; 0: that of a step [time]
  /// Recent contacts (of two spheres: two) and the time in which they happened.
  double contacts = 0, time = 0;
  double expected = 0;  ///< of a sphere in a unit of time; 0: the contacts that happened tell more
  double before = 0;    ///< time until then
};

class RunClock {
 public:
  /// `plan` must outlive the clock; its end may change. `stepping`: IntegratorInfo::stepping.
  RunClock(const Plan& plan, bool stepping, std::size_t particles);

  /// See Simulation::limit_slabs().
  void limit_slabs(std::uint64_t collisions) { most_collisions_ = collisions; }

  /// The time at which this number of steps is complete.
  double time_after(std::int64_t steps) const;
  /// The length of the step that starts then: to the end of the run, if this is less than a step by more than rounding.
  double length_from(double start) const;
  Slab next_slab(const Statistics& s) const;
  bool finished(const Statistics& s) const;
  double fraction_done(const Statistics& s) const;
  /// See Simulation::is_last_on_the_way().
  bool is_last_on_the_way(const Statistics& s) const;

  /// Counts a slab that was advanced by `reached` [time]: sets the steps and the time in `s`.
  /// `pairs` and `walls` are its contacts, `boxes` its PastEpoch::boxes. Returns the length of the step or epoch if
  /// that is now complete, else 0.
  double end_slab(const Slab& slab, double reached, std::uint64_t pairs, std::uint64_t walls, double boxes,
                  Statistics& s);
  /// The largest number of steps that an epoch may have.
  double most_steps() const;
  /// Sets the number of steps of the next epoch. Call when one is complete.
  void lengthen(double steps);
  /// For methods that adapt: the number of contacts of a sphere in a slab that is wanted (infinite: any), the number in
  /// a unit of time that is expected before any are known, and the longest first step [time].
  void expect(double most_contacts, double contacts, double longest);
  /// Sets the length of the next slabs after a complete one with this local error and number of contacts (of two
  /// spheres: two).
  void adapt(const Slab& slab, const LocalError& error, std::uint64_t contacts, double longest);
  /// Makes the slab shorter that was too long and will be repeated. Throws Error if it would be too short.
  void shorten(const Slab& slab, const StepTooLong& wanted);
  /// Whether each step has a length of its own.
  bool adapts() const;
  /// Call before a run goes on to another end: counts from here if the last slab was shortened to meet the previous
  /// one.
  void go_on(const Statistics& s);

  StepCount count;  ///< state of the run
  Pace pace;        ///< state of the run

 private:
  double step() const;
  double length_with_contacts() const;

  const Plan& plan_;
  bool stepping_;
  double particles_;
  double most_contacts_ = std::numeric_limits<double>::infinity();  // in a slab
  bool whole_ = true;                             // with Plan::accuracy: the end did not shorten the last slab
  std::uint64_t most_collisions_;                 // per slab of an epoch
  std::optional<std::uint64_t> last_collisions_;  // in the last slab, if this run has executed one
  bool cut_ = false;                              // whether the end of the plan shortened the last slab by whole steps
};

}  // namespace carom
