#pragma once
// Contacts for the integrators that cut the step of all particles (cva, mcva, cdda): which touch now, which first. The
// slab core takes its candidates and contacts at rest from here, too.
//
// Pairs come from a Verlet list with the radii as reach, walls from the box. Keys are those of the event core, so the
// order of simultaneous impulses is the same everywhere.

#include <functional>
#include <vector>

#include "engine/base/contact_log.h"
#include "engine/base/counters.h"
#include "engine/events/contact.h"
#include "engine/ranks/system.h"
#include "engine/search/neighbour_list.h"
#include "engine/slabs/resting.h"
#include "engine/slabs/slab_watch.h"

namespace carom {

/// A contact met or to come, and its normal: the gradient of the gap, up to a positive factor.
template <int D>
struct Touch {
  EventKey<D> key;  ///< key.time: since now for a contact to come
  Vec<D> normal;  ///< pair: x_lo − x_hi, acting on lo, and its negative on hi; wall: unit vector inwards, acting on lo
  bool pair() const { return key.kind == EventKind::pair; }
};

template <int D>
class ContactScan {
 public:
  /// `max_events` limits the contacts of one slab.
  ContactScan(const System<D>& system, std::uint64_t max_events);

  /// Starts a slab of this length: counts from zero, logs to `contacts` (may be null), and takes what speeds are
  /// rounding from the velocities and accelerations (length × acceleration) of the whole system. `watch` (may be null):
  /// called before each impulse of resolve().
  void begin_slab(Counters& counters, std::vector<Contact<D>>* contacts, Positions<D> a, double length,
                  SlabWatch* watch = nullptr);

  /// Applies `impulse` to every contact that touches and approaches at x, in key order, again until none approaches,
  /// and notes which contacts are left at rest. `impulse` changes the velocities in `v`. Throws
  /// Error(Failure::numerical) beyond max_events.
  void resolve(double time, Positions<D> x, Vectors<D> v, const std::function<void(const Touch<D>&)>& impulse);

  /// Whether nothing touches and approaches, or rests in contact.
  bool quiet(Positions<D> x, Positions<D> v) {
    collect(0, x, v);
    return approaching_.empty() && resting_.empty();
  }

  /// The contacts that the last resolve() found at rest, without any approach left.
  std::span<RestingContact<D>> resting() { return resting_; }
  bool rests(const EventKey<D>& key) const;

  /// Keeps resting contacts from approaching for a time `rest`: accelerations a become those of the held system. Those
  /// that nothing presses are resting no more.
  void hold(Positions<D> v, Vectors<D> a, double rest);

  /// Takes the approach out of resting contacts at new positions.
  void stop_approach(Positions<D> x, Vectors<D> v);

  /// The first contact on the parabolas x + v s + a s²/2 within [0, rest); key.time is kNever when there is none.
  /// Call resolve() before; contacts held at rest are not looked for.
  Touch<D> earliest(Positions<D> x, Positions<D> v, Positions<D> a, double rest);

  /// Turns the relative velocities of contacts that were held over a piece into the tangent at x, keeping their size
  /// and so the energy. (What a held piece of finite length leaves along the normal would make the pair bounce at
  /// once.)
  void slide(Positions<D> x, Vectors<D> v);

  /// The candidates, for methods that look for contacts themselves.
  NeighbourList<D>& list() { return list_; }

  double contact_distance(Id i, Id j) const { return particles_.radius[i] + particles_.radius[j]; }
  double tolerance(double sigma) const { return tolerance_(sigma); }
  /// Whether spheres at separation d touch.
  bool touches(const Vec<D>& d, double sigma) const {
    const double reach = sigma + tolerance(sigma);
    return d.squaredNorm() <= reach * reach;
  }
  /// The least gap a piece may end with, for a contact that touches at its start: one that rounding has left at the
  /// edge of the tolerance must be able to depart.
  double floor(double gap_at_start, double tolerance) const {
    return std::min(-tolerance, gap_at_start - std::numeric_limits<double>::epsilon() * box_.edges.maxCoeff());
  }
  std::span<const Wall<D>> walls() const { return walls_; }

  /// Counts one more contact or empty piece; throws when the slab needs more than max_events.
  void count_event(const EventKey<D>& key);

  /// Counts and logs contacts that were found and executed elsewhere, since `time` in the slab.
  void commit(double time, std::span<const Contact<D>> executed);

  /// Approach of a contact slower than this is rounding [length/time].
  double resting_speed() const { return resting_speed_; }

 private:
  void collect(double time, Positions<D> x, Positions<D> v);
  double normal_speed(const Touch<D>& touch, Positions<D> v) const;

  const Box<D>& box_;
  const Particles<D>& particles_;
  const Decomposition<D>& decomposition_;
  std::vector<Wall<D>> walls_;
  GapTolerance tolerance_;
  NeighbourList<D> list_;
  std::uint64_t max_events_;
  std::uint64_t events_ = 0, events_at_last_cut_ = 0;
  Counters* counters_ = nullptr;
  std::vector<Contact<D>>* contacts_ = nullptr;
  SlabWatch* watch_ = nullptr;
  double resting_speed_ = 0;
  std::vector<Touch<D>> approaching_;
  std::vector<RestingContact<D>> resting_;
};

/// The elastic impulse: kinetic energy and momentum are kept.
template <int D>
void collide_elastically(const Touch<D>& touch, Particles<D>& particles);

}  // namespace carom
