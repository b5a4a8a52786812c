#pragma once
// The event core: runs flights through their contacts, in the order of their keys, to a given time.
//
// Every sphere is on a flight x + v s + g s²/2 (g the same for all: 0, or a uniform field) that is known from its
// record; an event changes the records of the spheres that take part in it and of nobody else. One pending event a
// particle is kept, with the particle that was scanned last; it is stale when its partner has had an event since, and
// the particle is scanned again when a stale event comes up (Lubachevsky, J. Comput. Phys. 94 (1991) 255). Cells prune
// the candidates; a crossing into another cell changes no record. Nothing that the search does can therefore reach the
// physics.
//
//   EventCore<3> core(box, particles);
//   core.load(particles, g, horizon);             // everybody at time 0
//   core.run(end, report);                        // events with time < end
//   core.fly_to(end, particles);                  // copies at `end`
//
// Spheres may grow meanwhile, all by a common factor (engine/compression.h): their contact distances and their
// distances from walls are then functions of time like their positions.

#include <limits>
#include <memory>
#include <queue>
#include <vector>

#include "engine/box.h"
#include "engine/calendar.h"
#include "engine/cell_grid.h"
#include "engine/contact_log.h"
#include "engine/counters.h"
#include "engine/event_counts.h"
#include "engine/particles.h"

namespace carom {

/// What the core knows of one sphere: its state right after its last event. One cache line in three dimensions.
template <int D>
struct alignas(64) Record {
  Vec<D> x;  ///< not wrapped within a slab
  Vec<D> v;
  double t;  ///< of the last event, since the start of the slab
  Id id;
  std::uint16_t generation;
  std::uint16_t species;
};

template <int D>
class EventCore {
 public:
  /// Limits of one run(), and where its results go.
  struct Report {
    Counters& counters;
    std::vector<Contact<D>>* contacts = nullptr;
    std::uint64_t collision_limit = std::numeric_limits<std::uint64_t>::max();  ///< of counters.sphere_sphere
    std::uint64_t max_events = std::numeric_limits<std::uint64_t>::max();       ///< contacts since load()
  };

  /// Masses and radii are read from `particles`, which outlives the core; they change between slabs only.
  EventCore(const Box<D>& box, const Particles<D>& particles);
  ~EventCore();
  EventCore(const EventCore&) = delete;
  EventCore& operator=(const EventCore&) = delete;

  /// Starts a slab: everybody at time 0 at particles.x with particles.v, under the acceleration g. No event at or after
  /// `horizon` will be asked for. All radii are those of the particles times 1 + growth·t, t since the start of the
  /// slab; `growth` ≥ 0 [1/time].
  void load(const Particles<D>& particles, const Vec<D>& g, double horizon, double growth = 0);

  /// Executes every event before `end`, or up to the collision limit; returns the time reached: `end`, or that of the
  /// last collision. Throws Error(Failure::numerical) when more than max_events contacts are needed.
  double run(double end, const Report& report);

  /// Copies of all spheres flown to `time`, which no event precedes any more.
  void fly_to(double time, Particles<D>& copies) const;

  /// Since the core was made.
  const EventCounts& counts() const { return counts_; }

 private:
  struct Pending {
    EventKey<D> contact;                // the next contact; its time is kNever when there is none
    std::uint32_t partner_version = 0;  // the contact is stale when the partner's has moved on
    double crossing = 0;                // when the particle leaves its cell
    std::uint8_t face = 0;              // through: 2·axis + (0 downwards, 1 upwards)
    std::uint32_t stamp = 0;            // of the calendar entry that stands for the earlier of the two
    bool crosses_first() const { return crossing < contact.time; }
  };
  /// An event among several at one time, with the key it had when it was found there.
  struct Tied {
    CalendarEntry entry;
    bool crossing;
    EventKey<D> key;
    bool operator<(const Tied& other) const {  // crossings last; std::priority_queue keeps the largest on top
      return crossing != other.crossing ? crossing : other.key < key;
    }
  };

  /// A radius or a contact distance as it is at a time.
  double grown(double length, double t) const { return length * (1 + growth_ * t); }
  bool valid(const CalendarEntry& entry) const { return pending_[entry.slot].stamp == entry.stamp; }
  bool next_event(double end, CalendarEntry& entry);
  void predict(Id i, double now);
  void predict_pairs(Id i, const Cell<D>& low, const Cell<D>& high);
  void predict_pair(Id i, Id j, const Image<D>& image_of_j, Pending& best) const;
  void predict_walls(Id i, Pending& best) const;
  void predict_crossing(Id i, double now, Pending& pending) const;
  void schedule(Id i);
  std::uint32_t generation_at(const Record<D>& r, double t) const;
  void advance(Record<D>& r, double t) const;
  void cross(Id i);
  void set_generation(Record<D>& r, const EventKey<D>& key);
  void collide_pair(const EventKey<D>& key, const Report& report);
  void collide_wall(const EventKey<D>& key, const Report& report);
  void insert(Id i, std::size_t cell);
  void remove(Id i);

  const Box<D>& box_;
  const Particles<D>& particles_;
  Vec<D> g_ = Vec<D>::Zero();
  bool field_ = false;
  double horizon_ = 0, growth_ = 0;

  std::vector<Record<D>> records_;
  std::vector<std::uint32_t> version_;  // grows with every event of the particle
  std::vector<Pending> pending_;
  Calendar calendar_;
  std::priority_queue<Tied> tied_;  // events at one and the same time, in the order of their keys

  std::unique_ptr<CellGrid<D>> grid_;
  std::vector<Cell<D>> cell_;  // unwrapped
  static constexpr Id kNobody = std::numeric_limits<Id>::max();
  std::vector<Id> first_, next_, previous_;  // who is in a cell: a list through the particles
  EventCounts counts_;
  std::uint64_t events_ = 0;                  // contacts since load()
  std::size_t scheduled_ = 0, expected_ = 0;  // entries of this slab, and of the last
};

}  // namespace carom
