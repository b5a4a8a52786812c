// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Which spheres a subdomain owns, and which are ghosts: here of those of other subdomains, elsewhere of its own.
//
// Each subdomain finds this for all spheres that it has from where they are, and all find the same. A sphere is looked
// at again when it may have come so far that the answer changes.

#include <bit>
#include <limits>
#include <vector>

#include "engine/events/event_core.h"
#include "engine/ranks/bisection.h"
#include "engine/ranks/id_table.h"

namespace carom {

template <int D>
class Ownership {
 public:
  /// Of the spheres of a core, which outlives this.
  explicit Ownership(EventCore<D>& core) : core_(core) {}

  /// The core has been loaded with all spheres that concern subdomain `number` of a bisection. What is own and what is
  /// not is known after sort_out().
  void load(const Bisection<D>& bisection, std::uint32_t number, double max_displacement);

  bool owns(Slot i) const { return role_[i] == Role::own || role_[i] == Role::seen; }
  bool is_ghost(Slot i) const { return role_[i] == Role::ghost; }
  /// Whether an own sphere is a ghost elsewhere.
  bool is_seen(Slot i) const { return role_[i] == Role::seen; }
  bool owns_id(Id id) const {
    const Slot i = slots_.find(id);
    return i != IdTable::kNowhere && owns(i);
  }
  /// As in Subdomain.
  std::vector<Slot> own() const;
  std::uint64_t holders(Slot i) const { return holders_[i]; }
  Slot slot_of(Id id) const { return slots_.find(id); }
  bool admit(const Record<D>& r, double now);
  /// As in Subdomain, after a window of a `length` [time]. Spheres for which deflected(slot) is true may have other
  /// velocities than before it.
  template <class Deflected, class Send>
  void sort_out(double now, double length, Deflected&& deflected, Send&& send);

  /// Where a ghost with this record can meet own spheres before `end`: these are within `max_displacement` of the
  /// subdomain, and are known where they come within another two. Between two corners; false: nowhere.
  bool meeting_place(const Record<D>& r, double end, Vec<D>& low, Vec<D>& high) const;
  /// Whether a sphere with this record can come together at all, before `end`, with another one, which is known where
  /// it comes within twice `max_displacement`.
  bool may_meet(const Record<D>& r, Slot j, const Vec<D>& shift, double end) const;

 private:
  static constexpr double kUnknown = -1;
  static constexpr double kWindowsBetweenSearches = 20;       // windows between searches for spheres at the border
  enum class Role : std::uint8_t { none, own, seen, ghost };  // none: no sphere; seen: own, and a ghost elsewhere

  struct Watched {
    Slot slot;
    double quiet;             // how far it may come before it must be looked at again
    double speed = kUnknown;  // until its next event; unknown: as large as any
  };

  void enlist(Slot i, Role role);
  void forget(Slot i);
  void watch(double now);
  Watched look_at(Slot i, double now);
  /// How far a sphere comes from its record before `end` at most.
  double way(const Record<D>& r, double end) const {
    const double time = end - r.t;
    return (r.v.norm() + 0.5 * time * core_.flights().g().norm()) * time;
  }

  EventCore<D>& core_;
  const Bisection<D>* bisection_ = nullptr;
  std::uint32_t number_ = 0;
  double max_displacement_ = 0;  // in a window
  double unwatched_ = 0;         // how far spheres may have come since watch()
  IdTable slots_;
  std::vector<Role> role_;              // by slot
  std::vector<std::uint64_t> holders_;  // by slot
  std::vector<Watched> watched_;        // ghosts, and own spheres that may leave, or that others may see
};

template <int D>
template <class Deflected, class Send>
void Ownership<D>::sort_out(double now, double length, Deflected&& deflected, Send&& send) {
  if (unwatched_ += max_displacement_; unwatched_ > kWindowsBetweenSearches * max_displacement_) watch(now);
  std::size_t stay = 0;
  for (Watched each : watched_) {
    const Slot i = each.slot;
    if (each.speed >= 0 && deflected(i)) each.speed = kUnknown;
    each.quiet -= each.speed >= 0 ? each.speed * length : max_displacement_;
    if (!(each.quiet > 0)) {
      const std::uint64_t before = holders_[i];
      each = look_at(i, now);
      if (role_[i] == Role::none) continue;
      for (std::uint64_t fresh = holders_[i] & ~before; fresh != 0; fresh &= fresh - 1)
        send(static_cast<std::size_t>(std::countr_zero(fresh)), core_.flights()[i]);
    }
    watched_[stay++] = each;
  }
  watched_.resize(stay);
}

}  // namespace carom
