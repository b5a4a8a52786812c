// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Flies all particles through one slab, each on parabolas under a constant acceleration of its own, event by event.
//
//   core.begin(v, a, length);                  // candidate pairs of a slab from the system's positions, once
//   core.fly(a);                               // to the slab's end: x(), v(), contacts(); may be repeated with other a
//   core.commit(start);                        // counts and logs the contacts of the last flight
//
// A collision changes velocities, never an acceleration. Most particles have no contact in a slab: contacts are
// predicted only for pairs close enough to meet, and only particles that collide are flown in pieces. A contact is a
// function of two flights alone, so the bits depend on neither the list, nor the order, nor the rank.
//
// Where each rank knows only some of the particles (engine/ranks/decomposition.h), ranks compare their flights: owners
// send a hash of the events of each particle that are ghosts on other ranks. If a ghost that matters had other events
// than there, or a path was longer than the halo allows, fly() throws HaloTooSmall on all ranks; the system is
// unchanged then.

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "engine/events/step_event.h"
#include "engine/ranks/system.h"
#include "engine/stepping/contact_scan.h"

namespace carom {

/// How a flight ended.
template <int D>
struct FlightEnd {
  bool complete = true;
  /// If incomplete: an acceleration bends paths far too much for the piece, or is NaN, or there are so many contacts
  /// that the end of the flight would be meaningless. If not set, the piece must end at `time`, because a contact comes
  /// to rest or a resting one is hit.
  bool too_strong = false;
  /// When that event happens; the spheres touch then, with a gap that leaves room for rounding. 0: at the start of the
  /// piece, where the contacts must be resolved again.
  double time = 0;
  EventKey<D> key{};  ///< the event that made the flight incomplete
};

template <int D>
class SlabCore {
 public:
  /// `max_events` limits the contacts of one step.
  SlabCore(System<D>& system, std::uint64_t max_events);
  ~SlabCore() { system_.fields.remove_working(this); }
  SlabCore(const SlabCore&) = delete;
  SlabCore& operator=(const SlabCore&) = delete;

  /// Starts a step; see ContactScan::begin_step. fly() calls `watch` too.
  void begin_step(Counters& counters, std::vector<Contact<D>>* contacts, const std::vector<Vec<D>>* a, double length,
                  SlabWatch* watch = nullptr, std::uint64_t already = 0) {
    already_ = already;
    counters_ = &counters;
    log_ = contacts;
    watch_ = watch;
    if (!reactions_.empty()) system_.decomposition.need_all();
    scan_->begin_step(counters, contacts, a, length, watch, already);
  }

  /// Finds the pairs that may meet in a slab of this length [time], from the system's positions with velocities v (in
  /// the laboratory, also in a sheared box), under accelerations a or others not much larger. `resolved`:
  /// ContactScan::resolve() has handled the contacts at the start.
  void begin(Positions<D> v, Positions<D> a, double length, bool resolved = false);

  /// Flies from the start of the slab to its end, straight if `a` is empty. Throws SlabLeft if the run is to stop.
  FlightEnd<D> fly(Positions<D> a);

  const std::vector<Vec<D>>& x() const { return x_; }            ///< positions at the slab's end, not wrapped [length]
  const std::vector<Vec<D>>& last_x() const { return last_x_; }  ///< positions at the end of the flight before
  const std::vector<Vec<D>>& v() const { return v_; }            ///< velocities there [length/time]
  /// Whether a particle's end point differs from that of the flight before; and their number on all ranks.
  const std::vector<char>& moved() const { return moved_; }
  std::uint64_t all_moved() const { return counts_[0]; }
  /// The contacts of the last flight, in the order of their keys.
  std::span<const Contact<D>> contacts() const { return contacts_; }

  /// Their number on all ranks; contacts of two spheres count twice.
  std::uint64_t all_contacts() const { return counts_[1]; }

  /// Whether particle i has a contact in the last flight.
  bool collides(Id i) const { return slot_[i] != 0; }

  /// The particles with another sequence of partners than in the flight before, ascending.
  std::span<const Id> swapped() const { return swapped_; }

  /// Counts and logs the contacts of the last flight; the slab starts at `time` within the step.
  void commit(double time);

  /// Moves the particles, and moving walls, to the slab's end.
  void finish(Particles<D>& particles) {
    particles.x.swap(x_);
    particles.v.swap(v_);
    if (box_.contacts.need_internal())
      for (const Flight& each : flights_) particles.set_internal(each.id, each.internal);
    system_.box.advance(length_);
  }

  /// The contacts at the slab's start, and the resting ones.
  ContactScan<D>& scan() { return *scan_; }

 private:
  /// A particle after its first collision in this slab.
  struct Flight {
    Vec<D> x, v;
    double t;
    Id id;
    std::uint32_t version, generation;
    std::uint64_t hash;    ///< hash of the particle's sequence of partners
    Internal<D> internal;  ///< if spheres have one
  };
  struct Planned {
    EventKey<D> key;
    std::uint32_t version_lo = 0, version_hi = 0;                           ///< versions of the two flights
    bool operator<(const Planned& other) const { return other.key < key; }  // a standard heap has the largest on top
  };
  struct Sequence {
    Id id;
    std::uint64_t hash;
    auto operator<=>(const Sequence&) const = default;
  };

  struct Meeting;
  void release();
  void find_near();
  void reject_wide_margin();
  void plain_ends();
  void predict_first();
  FlightEnd<D> serve();
  void predict_pair(Id i, Id j, const Image<D>& image);
  void predict_walls(Id i);
  double step_time(const PairMotion<D>& motion, const PairSteps& steps, Id i, Id j, double time_left,
                   double slack) const;
  const StepSurface* step_of(const EventKey<D>& key) const;
  /// Whether it is an event at a step of finite height; else it is a contact, of a tether from inside.
  bool crosses(const EventKey<D>& key) const {
    const StepSurface* const step = step_of(key);
    return step && !step->tether();
  }
  double end_after(const EventKey<D>& key) const;
  void predict_all(Id i);
  void predict_both(const EventKey<D>& key);
  template <class F>
  void timed(double& total, F&& work);
  bool comes_to_rest(const EventKey<D>& key) const;
  bool at_the_end(const EventKey<D>& key) const;
  bool falls_back(const EventKey<D>& key);
  double end_before(const EventKey<D>& key, bool held) const;
  void collide(const EventKey<D>& key);
  Flight& flight(Id i, const EventKey<D>& key);
  double path(const Vec<D>& v, const Vec<D>& a, double time) const { return time * (v.norm() + 0.5 * time * a.norm()); }
  /// The velocity of particle i relative to the flow where it was at the slab's start.
  Vec<D> beside_flow(Id i, Vec<D> v) const {
    v[0] -= box_.flow(particles_.x[i]);
    return v;
  }
  /// How far particle i may come in this slab from where the flow carries it, if its flight f goes on.
  double farthest(const Flight& f) const {
    Vec<D> moved = f.x - particles_.x[f.id];
    moved[0] -= f.t * box_.flow(particles_.x[f.id]);
    return moved.norm() + path(beside_flow(f.id, f.v), acceleration(f.id), length_ - f.t);
  }
  /// How much farther two particles may be apart at the start of the slab than they will come in the flow, relatively:
  /// the largest singular value of its strain, as in engine/search/flow_frame.h.
  double stretch() const {
    const double half = 0.5 * std::abs(box_.shear_rate) * length_;
    return half + std::sqrt(1 + half * half);
  }
  /// Records the length of a path that exceeds margin_.
  void note_path(double path) { longest_path_ = std::isnan(path) ? kNever : std::max(longest_path_, path); }
  void compare_sequences();
  void compare_ranks(bool failed);

  Vec<D> acceleration(Id i) const { return a_.empty() ? Vec<D>(Vec<D>::Zero()) : a_[i]; }
  double start(Id i) const { return slot_[i] == 0 ? 0.0 : flights_[slot_[i] - 1].t; }
  std::uint32_t version(Id i) const { return slot_[i] == 0 ? 0 : flights_[slot_[i] - 1].version; }
  std::uint32_t generation(Id i, double t) const {
    return slot_[i] != 0 && flights_[slot_[i] - 1].t == t ? flights_[slot_[i] - 1].generation + 1 : 0;
  }
  Vec<D> position(Id i, double t) const;
  Vec<D> velocity(Id i, double t) const;

  System<D>& system_;
  const Box<D>& box_;
  const Particles<D>& particles_;
  std::vector<Reaction<D>> reactions_;
  std::optional<ContactScan<D>> scan_;
  std::vector<Wall<D>> walls_;
  bool has_steps_ = false;
  std::uint64_t max_events_, already_ = 0;
  double most_bend_;  // largest ½ a h² that is tried [length]
  Counters* counters_ = nullptr;
  std::vector<Contact<D>>* log_ = nullptr;
  SlabWatch* watch_ = nullptr;
  double length_ = 0;
  double margin_ = 0;  // pairs_ has all pairs whose two paths are at most this long; infinite: the flight is rejected
  double own_longest_path_ = 0;
  double longest_path_ = 0;  // the longest path of this flight that exceeds margin_; 0: none; infinite: rejected
  bool too_many_contacts_ = false, resolved_ = false;
  bool left_ = false;         // this rank was asked to stop during this flight
  Positions<D> start_v_, a_;  // velocities at the slab's start, accelerations
  std::span<const NeighbourPair<D>> pairs_;
  std::vector<std::uint32_t> near_;      // indices of the pairs that may meet before any other collision
  std::vector<double> longest_path_of_;  // by particle: the longest path for which `near_` is complete
  std::vector<double> largest_bend_;     // by particle: the largest |½ a h²| for which `near_` is complete
  std::vector<Id> beyond_;               // particles with a larger |½ a h²|
  std::vector<char> held_;               // by particle: has a resting contact; empty: none has
  std::vector<Vec<D>> x_, last_x_, v_;
  std::vector<char> moved_;
  std::array<std::uint64_t, 2> counts_{};  // all_moved(), all_contacts()
  std::vector<std::uint32_t> slot_;        // by particle: 1 + its index in flights_, or 0
  std::vector<Flight> flights_;
  std::vector<Planned> queue_;  // a heap
  std::vector<Contact<D>> contacts_;
  std::vector<Sequence> sequences_, last_sequences_;
  std::vector<Id> swapped_;
};

}  // namespace carom
