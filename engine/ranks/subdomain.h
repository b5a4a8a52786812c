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
//   while (…) { subdomain.paths().read_script(message); …; subdomain.repair(); … subdomain.changed() … }
//   subdomain.commit();
//   subdomain.sort_out(now, send); …; subdomain.ownership().admit(record, now, spin);

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

  /// Frees the memory for plans, and release() that for spheres, until the next load().
  void stop() { core_.stop(); }
  void release();

  // Between windows: no event before the time `now` may be pending.

  std::vector<Slot> own() const { return ownership_->own(); }
  const Flights<D>& flights() const { return core_.flights(); }
  Ownership<D>& ownership() { return *ownership_; }
  WindowPaths<D>& paths() { return *paths_; }
  const WindowPaths<D>& paths() const { return *paths_; }
  /// Updates ownership and ghosts here and elsewhere, and removes spheres that are neither own nor ghosts. Calls
  /// send(k, record) for spheres that the k-th neighbour lacks and must admit.
  template <class Send>
  void sort_out(double now, Send&& send) {
    ownership_->sort_out(now, length_, send);
  }

  // In a window.

  /// Runs from `now` to `end`. The window is invalid if a sphere moves farther than `max_displacement` from its start:
  /// cut it before that. Returns `end`, or the time of the first event for which the log has no room; the window is
  /// then invalid too.
  double run(double now, double end);
  void repair();
  /// Calls visit(slot, k) for each node k that is a contact with its lower id owned here.
  template <class Visit>
  void for_each_contact(Visit&& visit) {
    paths_->for_each_own([&](Slot i) {
      for (std::size_t k = 1; k <= paths_->size(i); ++k)
        if (const Node<D> each = paths_->node(i, k); each.key.lo == each.after.id) visit(i, k);
    });
  }
  /// Own spheres that are ghosts elsewhere and got new paths in the last run() or repair().
  std::span<const Slot> changed() const { return changed_; }
  /// An upper limit of the contacts in paths().tally().
  std::uint64_t most_events() const { return paths_->trace().events().size() + redone_events_ - redone_before_; }
  /// The largest speed of any sphere after an event.
  double fastest() const { return std::sqrt(paths_->trace().fastest_squared()); }
  /// Ends the window.
  void commit();

  EventCounts counts() const { return core_.counts(); }
  std::uint64_t run_events() const { return run_events_; }        ///< events of first runs
  std::uint64_t redone_events() const { return redone_events_; }  ///< events of repairs

 private:
  const Box<D>& box_;
  EventCore<D> core_;
  std::optional<Ownership<D>> ownership_;
  std::optional<WindowPaths<D>> paths_;
  std::optional<WindowRepair<D>> repair_;
  double end_ = 0, length_ = 0;  // the present window
  std::vector<Slot> changed_;
  std::uint64_t run_events_ = 0;
  std::uint64_t redone_events_ = 0, redone_before_ = 0;  // now; before the present window
};

}  // namespace carom
