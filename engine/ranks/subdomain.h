// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// One subdomain of a system that is divided among several event cores, and what makes it agree with its neighbours.
//
// A subdomain owns the spheres in it and has copies of those near it, ghosts, which other subdomains own (ownership.h).
// Time goes in windows. In each the subdomain runs what it has as if there were no others, and records all paths
// (window_paths.h). Then the owners send the paths of their spheres, which for the others are scripts of their ghosts;
// where a script differs from what was seen here the window is repaired (window_repair.h), from the first difference on
// and only as far as that reaches, in the order of keys. Paths that have changed are sent again, until nothing changes:
// then every ghost was seen as its owner has it, and since a contact is a pure function of two records, all is as in a
// run by one core. (The smallest key at which any path is wrong grows with each round.)
//
//   subdomain.load(records, bisection, number, …);
//   subdomain.run(now, end);
//   while (…) { subdomain.follow(id, message); …; subdomain.repair(); … subdomain.changed() … }
//   subdomain.commit();
//   subdomain.sort_out(now, send); …; subdomain.admit(record, now);

#include "engine/ranks/window_repair.h"

namespace carom {

template <int D>
class Subdomain {
 public:
  /// `sizes` has the masses and radii of all spheres, and outlives the subdomain.
  Subdomain(const Box<D>& box, const Sizes& sizes, const SearchOptions& options)
      : box_(box),
        core_(box, &sizes, options),
        ownership_(core_),
        paths_(core_.flights(), ownership_),
        repair_(box, core_, ownership_, paths_) {}

  /// Starts anew at time `now` as subdomain `number` of a bisection, with all spheres that concern it. In no window
  /// will a sphere come farther than `max_displacement`.
  void load(std::vector<Record<D>> records, const Bisection<D>& bisection, std::uint32_t number, const Vec<D>& g,
            double horizon, double now, double max_displacement);

  // Between windows, at a time `now` that no event precedes any more.

  /// Own spheres, all of them.
  std::vector<Slot> own() const { return ownership_.own(); }
  const Flights<D>& flights() const { return core_.flights(); }
  /// Updates ownership and ghosts, those here and those elsewhere; spheres that are neither own nor ghosts are removed.
  /// Calls send(k, record) for spheres that the k-th neighbour does not have yet and must admit.
  template <class Send>
  void sort_out(double now, Send&& send) {
    const auto deflected = [&](Slot i) { return paths_.trace().has(i) || disturbed_[i] != 0; };
    ownership_.sort_out(now, length_, deflected, send);
    for (const auto& [slot, record] : other_) disturbed_[slot] = 0;
  }
  /// Takes in a ghost; false: load anew, there is no room left.
  bool admit(const Record<D>& r, double now) { return ownership_.admit(r, now); }

  // In a window.

  /// Runs from `now` to `end`. Where a sphere comes farther than `max_displacement` from its start the window is
  /// invalid: cut it before that. Returns the end, or the time of the first event for which the log has no room: it is
  /// invalid then, too.
  double run(double now, double end);
  /// Appends the path of a sphere to a message.
  void write_path(Slot i, Bytes& to) const { paths_.write(i, to); }
  /// Reads the path of a ghost that its owner has sent; the message must stay until the end of the window.
  void follow(Id id, Reader& message) { paths_.read_script(slot_of(id), message); }
  /// Repairs the window after scripts have come.
  void repair() { changed_ = repair_.run(); }
  /// What a sphere did in the window.
  std::span<const Node<D>> path(Slot i) { return paths_.path(i); }
  /// The sphere before node k of its path.
  const Record<D>& before(Slot i, std::size_t k) { return paths_.before(i, k); }
  /// The sphere after the last of them.
  const Record<D>& after(Slot i) const { return paths_.after(i); }
  /// Calls visit(slot) for each own sphere that had events at any time.
  template <class Visit>
  void for_each_touched(Visit&& visit) const {
    paths_.for_each_own(visit);
  }
  /// Calls visit(slot, k) for each node k of a path that stands for a contact of which the lower id is owned.
  template <class Visit>
  void for_each_contact(Visit&& visit) {
    for_each_touched([&](Slot i) {
      const auto nodes = path(i);
      for (std::size_t k = 0; k < nodes.size(); ++k)
        if (nodes[k].key.lo == nodes[k].after.id) visit(i, k);
    });
  }
  /// That contact.
  Contact<D> contact_of(Slot lo, std::size_t k);
  /// Own spheres that are ghosts elsewhere, and have other paths than before the last run() or repair().
  std::span<const Slot> changed() const { return changed_; }
  /// Which neighbours have an own sphere as a ghost: a bit for each.
  std::uint64_t holders(Slot i) const { return ownership_.holders(i); }
  Slot slot_of(Id id) const { return ownership_.slot_of(id); }
  /// What own spheres did in a window; each collision counts where its lower id is owned.
  ContactTally tally() const { return paths_.tally(); }
  /// The largest speed of any sphere after an event.
  double fastest() const { return std::sqrt(std::max(paths_.trace().fastest_squared(), repair_.fastest_squared())); }
  /// Whether, before a time, all ghosts have the same events here as with their owners.
  bool agrees(double end) { return paths_.agree(end); }
  /// Removes all events after `last`. The core is invalid then; load() again.
  void cut(const EventKey<D>& last) { paths_.cut(last); }
  /// Ends the window.
  void commit();

  EventCounts counts() const { return core_.counts(); }
  std::uint64_t run_events() const { return run_events_; }          ///< of all first runs
  std::uint64_t redone_events() const { return repair_.events(); }  ///< in repairs

 private:
  const Box<D>& box_;
  EventCore<D> core_;
  Ownership<D> ownership_;
  WindowPaths<D> paths_;
  WindowRepair<D> repair_;
  double end_ = 0, length_ = 0;  // of the window
  std::vector<Slot> changed_;
  std::vector<std::pair<Slot, Record<D>>> other_;  // after the last window: records that were not those of the core
  std::vector<std::uint8_t> disturbed_;            // by slot: it is among them
  std::uint64_t run_events_ = 0;
};

}  // namespace carom
