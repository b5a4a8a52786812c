// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Ownership of the spheres of a subdomain, and its ghosts: copies here of spheres owned elsewhere and vice versa.
//
// Each subdomain computes the ownership of all its spheres from their positions, and all subdomains get the same
// result. A sphere is examined again once it may have moved so far that the result changes.

#include <algorithm>
#include <bit>
#include <limits>
#include <utility>
#include <vector>

#include "engine/base/prefetch.h"
#include "engine/events/event_core.h"
#include "engine/ranks/bisection.h"
#include "engine/ranks/id_table.h"

namespace carom {

template <int D>
class Ownership {
 public:
  /// For a core with all spheres near subdomain `number` of a bisection; both must outlive this object. Ownership is
  /// valid after sort_out().
  Ownership(EventCore<D>& core, const Bisection<D>& bisection, std::uint32_t number, double max_displacement);

  bool owns(Slot i) const { return role_[i] == Role::own; }
  bool is_ghost(Slot i) const { return role_[i] == Role::ghost; }
  /// Whether an own sphere is a ghost elsewhere.
  bool is_seen(Slot i) const { return holders_[i] != 0; }
  bool owns_id(Id id) const {
    const Slot i = slots_.find(id);
    return i != IdTable::kNowhere && owns(i);
  }
  /// As in Subdomain.
  std::vector<Slot> own() const;
  /// The neighbours that have it as a ghost: one bit for each.
  std::uint64_t holders(Slot i) const { return holders_[i]; }
  Slot slot_of(Id id) const { return slots_.find(id); }
  bool admit(const Record<D>& r, double now, const Internal<D>& internal = {});
  void prefetch(Slot i) const { prefetch_line(&watched_at_[i]); }
  /// Call in a window for each event of a sphere, or with `several` for a sphere that may have had several. Returns
  /// false if the sphere is not watched, because it is far from the border and neither a ghost nor seen.
  bool note_event(Slot i, bool several = false) {
    const std::uint32_t k = watched_at_[i];
    if (k == kUnwatched) return false;
    if (events_[k] == Events::none) with_events_[number_with_events_++] = i;
    events_[k] = events_[k] == Events::none && !several ? Events::one : Events::several;
    return true;
  }
  /// Updates owners and ghosts after a window of this length [time]. Calls send(neighbour, record) for each own sphere
  /// that has become a ghost there.
  template <class Send>
  void sort_out(double now, double length, Send&& send);

  /// The region, between two corners, in which a ghost with this record can meet own spheres before `end`: own spheres
  /// stay within `max_displacement` of the subdomain, and are known within another two. False if it is empty.
  bool meeting_place(Slot ghost, const Record<D>& r, double end, Vec<D>& low, Vec<D>& high) const;
  /// The largest distance of a sphere from its record before `end`; under shear, across the flow.
  double way(const Record<D>& r, double end) const {
    const double time = end - r.t;
    return (core_.flights().speed(r) + 0.5 * time * core_.flights().g().norm()) * time;
  }
  /// Whether a sphere with this record can touch sphere j before `end`; j may be up to twice `max_displacement` from
  /// its record.
  bool may_meet(const Record<D>& r, Slot j, const Offset<D>& offset, double end) const;

 private:
  static constexpr double kWindowsBetweenSearches = 40;  // windows between searches for spheres at the border
  enum class Role : std::uint8_t { none, own, ghost };   // none: empty slot
  enum class Events : std::uint8_t { none, one, several };

  static constexpr std::uint32_t kUnwatched = std::numeric_limits<std::uint32_t>::max();

  void watch_over(Slot i, double quiet = 0) {
    watched_at_[i] = static_cast<std::uint32_t>(watched_.size());
    watched_.push_back(i);
    quiet_.push_back(quiet);
    speed_.push_back(speed(i));
    events_.push_back(Events::none);
  }
  /// How far an own sphere that is no ghost elsewhere can move before it may become one.
  static double quiet_at(double depth, double reach) { return depth - (1 + 1e-6) * reach; }
  /// The distance from a subdomain at which a sphere is a ghost there.
  double reach(Slot i) const { return bisection_.reach_of(core_.flights().reach(i)); }
  void enlist(Slot i, Role role) {
    slots_.add(core_.flights()[i].id, i);
    role_[i] = role;
  }
  void forget(Slot i);
  void watch(double now);
  double update_role(Slot i, double now);
  /// The largest speed across cuts of a sphere until its next event, not 0. Under shear no cut crosses the flow's axis.
  double speed(Slot i) const {
    return (1 + 1e-6) * bisection_.across_cuts(core_.flights()[i].v).norm() + from_field_ +
           std::numeric_limits<double>::min();
  }

  EventCore<D>& core_;
  const Bisection<D>& bisection_;
  std::uint32_t number_;
  double max_displacement_;                                     // largest displacement in a window
  double unwatched_ = std::numeric_limits<double>::infinity();  // the largest displacement of spheres since watch()
  double from_field_;                                           // the largest speed that the field adds
  IdTable slots_;
  std::vector<Role> role_;                 // by slot
  std::vector<std::uint32_t> watched_at_;  // by slot: index in watched_, or kUnwatched
  std::vector<std::uint64_t> holders_;     // by slot
  std::vector<Slot> watched_;              // ghosts, and own spheres that may leave or become ghosts elsewhere
  std::vector<double> quiet_;              // of each: how far it may move before it must be examined again
  std::vector<double> speed_;              // of each: the largest until its first event since sort_out()
  std::vector<Events> events_;             // of each: since sort_out()
  std::vector<Slot> with_events_;          // spheres with events since sort_out(), each once
  std::size_t number_with_events_ = 0;     // their number
};

template <int D>
template <class Send>
void Ownership<D>::sort_out(double now, double length, Send&& send) {
  if (unwatched_ += max_displacement_; unwatched_ > kWindowsBetweenSearches * max_displacement_) watch(now);
  // A sphere with one event moved at most as fast as before or after it, one with several at most max_displacement_.
  // Here only the excess over speed · length is subtracted; the loop below subtracts speed · length itself.
  constexpr std::size_t kAhead = 8;
  for (std::size_t n = 0; n < number_with_events_; ++n) {
    if (n + kAhead < number_with_events_) prefetch_line(&core_.flights()[with_events_[n + kAhead]]);
    const Slot i = with_events_[n];
    const std::uint32_t k = watched_at_[i];
    const double before =
        events_[k] == Events::one ? std::min(speed_[k] * length, max_displacement_) : max_displacement_;
    speed_[k] = speed(i);
    events_[k] = Events::none;
    quiet_[k] -= std::max(before - speed_[k] * length, 0.0);
  }
  number_with_events_ = 0;
  for (std::size_t k = 0; k < watched_.size(); ++k) quiet_[k] -= speed_[k] * length;
  const auto next = [&](std::size_t from) {
    const auto due = [](double quiet) { return !(quiet > 0); };
    return static_cast<std::size_t>(std::find_if(quiet_.begin() + from, quiet_.end(), due) - quiet_.begin());
  };
  for (std::size_t k = next(0); k < watched_.size(); k = next(k)) {
    const Slot i = watched_[k];
    const std::uint64_t before = holders_[i];
    quiet_[k] = update_role(i, now);
    if (role_[i] == Role::none) {  // the last one takes its place
      watched_at_[i] = kUnwatched;
      const auto drop = [k](auto& values) { values[k] = values.back(), values.pop_back(); };
      drop(watched_), drop(quiet_), drop(speed_), drop(events_);
      if (k < watched_.size()) watched_at_[watched_[k]] = static_cast<std::uint32_t>(k);
      continue;
    }
    speed_[k] = speed(i);
    for (std::uint64_t fresh = holders_[i] & ~before; fresh != 0; fresh &= fresh - 1)
      send(static_cast<std::size_t>(std::countr_zero(fresh)), core_.flights()[i]);
    ++k;
  }
}

}  // namespace carom
