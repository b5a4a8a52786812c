// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The event core: runs flights through their contacts, in the order of their keys, to a given time.
//
// Every sphere is on a flight x + v s + g s²/2 (g the same for all: 0, or a uniform field) that is known from its
// record; an event changes the records of the spheres that take part in it and no others. One pending event a particle
// is kept, with the particle that was scanned last; it is stale when its partner has had an event since, and the
// particle is scanned again when a stale event comes up (Lubachevsky, J. Comput. Phys. 94 (1991) 255). Neighbour lists
// prune the candidates, or cells where the system is dilute; neither changes a record. Nothing that the search does can
// therefore reach the physics.
//
// Spheres may grow meanwhile, all by a common factor (engine/setup/compression.h): their contact distances and their
// distances from walls are then functions of time like their positions.
//
//   EventCore<3> core(box, particles);
//   core.load(particles, g, horizon);             // all spheres at time 0
//   core.run(end, report);                        // events with time < end
//   core.fly_to(end, particles);                  // copies at `end`

#include "engine/base/counters.h"
#include "engine/events/event_search.h"
#include "engine/events/trace.h"

namespace carom {

template <int D>
class EventCore {
 public:
  /// Limits of one run(), and where its results go.
  struct Report {
    Counters& counters;
    std::vector<Contact<D>>* contacts = nullptr;
    std::uint64_t collision_limit = std::numeric_limits<std::uint64_t>::max();  ///< of counters.sphere_sphere
    std::uint64_t max_events = std::numeric_limits<std::uint64_t>::max();       ///< contacts since load()
    Trace<D>* trace = nullptr;  ///< where to write down paths; then contacts are not counted, they may be revoked
  };

  /// Masses and radii are read from `particles` at the start of each slab.
  EventCore(const Box<D>& box, const Particles<D>& /*particles*/, const SearchOptions& options = {})
      : EventCore(box, nullptr, options) {}
  /// For a core that runs a part of a larger system; `sizes` has the masses and radii of all of it, and outlives the
  /// core.
  EventCore(const Box<D>& box, const Sizes* sizes, const SearchOptions& options);
  EventCore(const EventCore&) = delete;
  EventCore& operator=(const EventCore&) = delete;

  /// Starts a slab: all spheres at time 0 at particles.x with particles.v, under the acceleration g. No event at or
  /// after `horizon` will be required. All radii are those of the particles times 1 + growth·t, t since the start of
  /// the slab; `growth` ≥ 0 [1/time].
  void load(const Particles<D>& particles, const Vec<D>& g, double horizon, double growth = 0);

  /// The same for those that are too many to be kept twice: their positions and velocities are taken out of
  /// `particles`, until give_back().
  void take(Particles<D>& particles, const Vec<D>& g, double horizon, double growth = 0);

  /// Ends a slab that began with take(): all spheres are flown to `time`, which no event precedes any more.
  void give_back(double time, Particles<D>& particles);

  /// Executes every event before `end`, or up to the collision limit; returns the time reached: `end`, or that of the
  /// last collision. Throws Error(Failure::numerical) when more than max_events contacts are needed.
  double run(double end, const Report& report);

  /// The time of the event that is executed, or was last.
  double now() const { return now_; }

  /// Copies of all spheres flown to `time`, which no event precedes any more.
  void fly_to(double time, Particles<D>& copies) const;

  /// Since the core was made.
  EventCounts counts() const;

  // For a core that runs a part of a larger system (engine/ranks/subdomain.h). All of this happens at a time `now` that
  // no event precedes any more.

  /// Starts with these spheres only; no record is of a later time than `now`. find_near() will use `max_displacement`.
  void load(std::vector<Record<D>> records, const Vec<D>& g, double horizon, double now, double max_displacement);
  const Flights<D>& flights() const { return flights_; }
  /// Takes a sphere in; false: there is no room left, load anew.
  bool admit(const Record<D>& r, double now, Slot& slot);
  /// Removes a sphere; its slot will be given to another one.
  void dismiss(Slot i);
  /// Replaces the records of these spheres.
  void put(std::span<const std::pair<Slot, Record<D>>> records, double now);
  /// Sets the spheres at the border of a subdomain: their lists are good for each other wherever they come in a window,
  /// and need not be searched for.
  void set_border(std::span<const Slot> slots, double now) { search_.set_border(slots, now); }
  /// Candidates for contacts of a sphere: all that may touch it where each of the two has come up to `max_displacement`
  /// (load) from where the core knows it to be. Good until the next call.
  std::span<const std::uint32_t> find_near(Slot i) { return search_.find_near(i); }
  /// The same for one at the border, where only others matter that are at the border and between two corners.
  std::span<const std::uint32_t> find_near_at_border(Slot i, const Vec<D>& low, const Vec<D>& high) {
    return search_.find_near_at_border(i, low, high);
  }

 private:
  void read(const Particles<D>& particles, const Vec<D>& g, double horizon, double growth);
  void collide_pair(Slot i, double time, std::uint32_t generation, const Report& report);
  void collide_wall(Slot i, double time, std::uint32_t generation, const Report& report);

  const Box<D>& box_;
  const Sizes* sizes_;  // of the larger system; null: there is none
  double sort_interval_;
  Flights<D> flights_;
  EventQueue<D> queue_;
  EventSearch<D> search_;
  std::vector<Slot> free_;  // slots of dismissed spheres
  double now_ = 0;
  std::uint64_t stale_ = 0;       // contacts that came up since the core was made
  std::uint64_t events_ = 0;      // contacts since load()
  std::uint64_t since_sort_ = 0;  // contacts
};

}  // namespace carom
