// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A subdomain of a system that is divided among several event cores, and the repair that makes it consistent with its
// neighbours.
//
// A subdomain owns the spheres in it and has copies of nearby ones, ghosts, which other subdomains own (ownership.h).
// Time is divided into windows. In each window the subdomain first runs its spheres as if there were no others, and
// records all paths (window_paths.h). Then owners send the paths of spheres that are ghosts elsewhere; for the
// ghost this path is its script. If a script differs from the path computed here, the window is repaired
// (window_repair.h) from the first difference on, in the order of keys and only as far as the difference propagates.
// Changed paths are sent again until nothing changes: then every ghost moved as on its owner, and since a contact is a
// pure function of two records, the result is that of a run on one core. (The smallest key at which any path is wrong
// grows with each round.)
//
//   subdomain.load(records, bisection, number, …);
//   subdomain.run(now, end);
//   while (…) { subdomain.follow(id, message); …; subdomain.repair(); … subdomain.changed() … }
//   subdomain.commit();
//   subdomain.sort_out(now, send); …; subdomain.admit(record, now, spin);

#include <optional>

#include "engine/ranks/window_repair.h"

namespace carom {

template <int D>
class Subdomain {
 public:
  /// `sizes` has the masses and radii of all spheres and must outlive the subdomain.
  Subdomain(const Box<D>& box, const Sizes& sizes, const SearchOptions& options)
      : box_(box), core_(box, &sizes, options) {}

  /// Starts at time `now` as subdomain `number` of a bisection, with all spheres near it. In no window may a sphere
  /// move farther than `max_displacement`.
  void load(std::vector<Record<D>> records, const Bisection<D>& bisection, std::uint32_t number, const Vec<D>& g,
            double horizon, double now, double max_displacement, const std::vector<Spin<D>>& spins = {});

  /// Frees the memory for plans, and then that for spheres, until the next load().
  void stop() { core_.stop(); }
  void release();

  // Between windows: no event before the time `now` may be pending.

  std::vector<Slot> own() const { return ownership_->own(); }
  const Flights<D>& flights() const { return core_.flights(); }
  /// Updates ownership and ghosts here and elsewhere, and removes spheres that are neither own nor ghosts. Calls
  /// send(k, record) for spheres that the k-th neighbour lacks and must admit.
  template <class Send>
  void sort_out(double now, Send&& send) {
    ownership_->sort_out(now, length_, send);
  }
  /// Adds a ghost; false if there is no room: load again.
  bool admit(const Record<D>& r, double now, const Spin<D>& spin = Spin<D>::Zero()) {
    return ownership_->admit(r, now, spin);
  }

  // In a window.

  /// Runs from `now` to `end`. The window is invalid if a sphere moves farther than `max_displacement` from its start:
  /// cut it before that. Returns `end`, or the time of the first event for which the log has no room; the window is
  /// then invalid too.
  double run(double now, double end);
  void write_path(Slot i, Bytes& to) const { paths_->write(i, to); }
  /// Reads the script of a ghost; the message must stay until the end of the window.
  void follow(Id id, Reader& message) { paths_->read_script(slot_of(id), message); }
  void repair() { changed_ = repair_->run(); }
  /// The events of a sphere in the window.
  std::span<const Node<D>> path(Slot i) { return paths_->path(i); }
  /// The same without storing the path, for many spheres: the number of events, and event k.
  std::size_t nodes(Slot i) const { return paths_->nodes(i); }
  Node<D> node(Slot i, std::size_t k) const { return paths_->node(i, k); }
  /// The sphere's record before node k of its path.
  const Record<D>& before(Slot i, std::size_t k) { return paths_->before(i, k); }
  /// The sphere's record after the last node.
  const Record<D>& after(Slot i) const { return paths_->after(i); }
  Spin<D> spin_after(Slot i) const { return paths_->spin_after(i); }
  /// Calls visit(slot) for each own sphere that had events in any version of the window.
  template <class Visit>
  void for_each_touched(Visit&& visit) const {
    paths_->for_each_own(visit);
  }
  /// Calls visit(slot, k) for each node k that is a contact with its lower id owned here.
  template <class Visit>
  void for_each_contact(Visit&& visit) {
    for_each_touched([&](Slot i) {
      for (std::size_t k = 0; k < nodes(i); ++k)
        if (const Node<D> each = node(i, k); each.key.lo == each.after.id) visit(i, k);
    });
  }
  /// The contact of node k, visited by for_each_contact().
  Contact<D> contact_of(Slot lo, std::size_t k);
  /// Own spheres that are ghosts elsewhere and got new paths in the last run() or repair().
  std::span<const Slot> changed() const { return changed_; }
  /// A bit for each neighbour that has an own sphere as a ghost.
  std::uint64_t holders(Slot i) const { return ownership_->holders(i); }
  Slot slot_of(Id id) const { return ownership_->slot_of(id); }
  /// An upper limit of the contacts in tally().
  std::uint64_t most_events() const { return paths_->trace().events().size() + redone_events() - redone_before_; }
  /// The contacts of the window; each counts where its lower id is owned.
  ContactTally tally() const { return paths_->tally(); }
  /// The largest speed of any sphere after an event.
  double fastest() const { return std::sqrt(std::max(paths_->trace().fastest_squared(), repair_->fastest_squared())); }
  /// Whether all ghosts have the same events here as on their owners before a time.
  bool consistent(double end) { return paths_->all_match(end); }
  /// Removes all events after `last`. The core is then invalid; load() again.
  void cut(const EventKey<D>& last) { paths_->cut(last); }
  /// Ends the window.
  void commit();

  EventCounts counts() const { return core_.counts(); }
  std::uint64_t run_events() const { return run_events_; }  ///< events of first runs
  std::uint64_t redone_events() const {                     ///< events of repairs
    return redone_events_ + (repair_ ? repair_->events() : 0);
  }

 private:
  const Box<D>& box_;
  EventCore<D> core_;
  std::optional<Ownership<D>> ownership_;
  std::optional<WindowPaths<D>> paths_;
  std::optional<WindowRepair<D>> repair_;
  double end_ = 0, length_ = 0;  // the present window
  std::vector<Slot> changed_;
  std::uint64_t run_events_ = 0;
  std::uint64_t redone_events_ = 0, redone_before_ = 0;  // until the last release(); before the present window
};

}  // namespace carom
