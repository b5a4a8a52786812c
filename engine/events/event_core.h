// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The event core executes the contacts of all spheres, in the order of their keys, up to a given time.
//
// Every sphere moves on x + v s + g s²/2 (g, zero or a uniform field, is common to all), which its record determines;
// an event changes only the records of the spheres that take part in it. The core stores one planned event for each
// particle, and the contact of a pair with the particle scanned last. A contact is stale if its partner has had an
// event since; the particle is scanned again when it is due (Lubachevsky, J. Comput. Phys. 94 (1991) 255). Neighbour
// lists, or cells in dilute systems, reduce the candidates without changing any record, so the search cannot affect the
// results.
//
// All spheres may grow by a common factor (engine/setup/compression.h): contact distances and distances from walls are
// then functions of time, like positions.
//
//   EventCore<3> core(box);
//   core.load(particles, g, horizon);             // all spheres at time 0
//   core.run(end, report);                        // executes events with time < end
//   core.copy_at(end, particles);                 // copies, advanced to `end`

#include "engine/events/event_search.h"
#include "engine/events/trace.h"
#include "engine/laws/counters.h"

namespace carom {

template <int D>
class EventCore {
 public:
  /// Limits of one run(), and where its results are stored.
  struct Report {
    Counters& counters;
    std::vector<Contact<D>>* contacts = nullptr;
    std::uint64_t collision_limit =
        std::numeric_limits<std::uint64_t>::max();                            ///< run() ends at counters.sphere_sphere
    std::uint64_t max_events = std::numeric_limits<std::uint64_t>::max();     ///< more contacts since load(): Error
    std::uint64_t contact_limit = std::numeric_limits<std::uint64_t>::max();  ///< contacts since load(): run() ends
    Trace<D>* trace = nullptr;  ///< records paths if given; contacts are then not counted, because they may be revoked
  };

  /// load() and take() read masses and radii from the particles that they get.
  explicit EventCore(const Box<D>& box, const SearchOptions& options = {}) : EventCore(box, nullptr, options) {}
  /// A core for part of a larger system; `sizes` has the masses and radii of the whole system and must outlive the
  /// core.
  EventCore(const Box<D>& box, const Sizes* sizes, const SearchOptions& options);
  EventCore(const EventCore&) = delete;
  EventCore& operator=(const EventCore&) = delete;

  /// Starts a slab: all spheres at time 0, at particles.x with velocities particles.v, under the acceleration g. No
  /// event at or after `horizon` is needed. Each radius is the particle's times 1 + growth·t, t since the start of
  /// the slab; `growth` ≥ 0 [1/time].
  void load(const Particles<D>& particles, const Vec<D>& g, double horizon, double growth = 0);

  /// Like load(), but moves positions and velocities out of `particles` until give_back(), to save memory.
  void take(Particles<D>& particles, const Vec<D>& g, double horizon, double growth = 0);

  /// Ends a slab that began with take(): moves all spheres back, advanced to `time`. No event before `time` may be
  /// pending.
  void give_back(double time, Particles<D>& particles);

  /// Executes every event before `end`, or up to one of the limits; returns the time reached: `end`, or that of the
  /// last contact. Throws Error(Failure::numerical) if more than max_events contacts are needed.
  double run(double end, const Report& report);

  /// The time of the current or last event.
  double now() const { return now_; }

  /// Copies all spheres, advanced to `time`. No event before `time` may be pending.
  void copy_at(double time, Particles<D>& copies) const;

  /// Counts since the core was constructed.
  EventCounts counts() const;

  // For a core that runs part of a larger system (engine/ranks/subdomain.h). No event before the time `now` may be
  // pending.

  /// Starts with these spheres; no record may be later than `now`. find_near() uses `max_displacement`. `internal`: the
  /// internal state of each, if there is one.
  void load(std::vector<Record<D>> records, const Vec<D>& g, double horizon, double now, double max_displacement,
            const std::vector<Internal<D>>& internal = {});
  /// Frees the memory for plans; load() again before the next event.
  void stop() {
    search_.clear();
    queue_.release();
  }
  /// Removes all spheres and frees their memory.
  void release() {
    stop();
    flights_.release();
  }
  const Flights<D>& flights() const { return flights_; }
  /// Adds a sphere; false if there is no room: load again.
  bool admit(const Record<D>& r, const Internal<D>& internal, double now, Slot& slot);
  /// Removes a sphere; its slot can be reused.
  void dismiss(Slot i);
  /// Replaces the records and internal states of these spheres.
  struct Changed {
    Slot slot;
    Record<D> record;
    Internal<D> internal;
  };
  void put(std::span<const Changed> spheres, double now);
  /// Sets the spheres at the border of a subdomain. Their lists contain each other however far they move in a window,
  /// so find_near_at_border() needs no search.
  void set_border(std::span<const Slot> slots, double now) { search_.set_border(slots, now); }
  /// Candidates for contacts of a sphere: all spheres that may touch it if both are displaced by up to
  /// `max_displacement` (load). Valid until the next call.
  std::span<const std::uint32_t> find_near(Slot i) { return search_.find_near(i); }
  /// find_near() for a sphere at the border that stays within `way` of x, restricted to border spheres between two
  /// corners.
  std::span<const std::uint32_t> find_near_at_border(Slot i, const Vec<D>& low, const Vec<D>& high, const Vec<D>& x,
                                                     double way) {
    return search_.find_near_at_border(i, low, high, x, way);
  }

 private:
  void read(const Particles<D>& particles, const Vec<D>& g, double horizon, double growth);
  /// Records two spheres before their collision; out of line, for the sake of collisions without a trace.
  [[gnu::noinline]] void begin_trace(Slot i, std::uint32_t partner, std::uint32_t generation, Trace<D>& trace) const;
  void collide_pair(Slot i, Slot j, std::uint32_t partner, double time, std::uint32_t generation, const Report& report);
  void meet_alone(Slot i, std::uint32_t generation, const Report& report);

  const Box<D>& box_;
  const Sizes* sizes_;  // sizes in the larger system; null if there is none
  double sort_interval_;
  Flights<D> flights_;
  EventQueue<D> queue_;
  EventSearch<D> search_;
  std::vector<Slot> free_;  // slots of dismissed spheres
  double now_ = 0;
  std::uint64_t stale_ = 0;       // stale contacts that came up since construction
  std::uint64_t events_ = 0;      // contacts since load()
  std::uint64_t since_sort_ = 0;  // contacts
};

}  // namespace carom
