// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A subdomain of a system that is divided among several event cores, one on each rank, and the exchange and repair of
// paths that make it consistent with its neighbours.
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
//   subdomain.load(messages, bisection, …);
//   while (…) {
//     subdomain.begin_window();
//     subdomain.run(now, end);
//     subdomain.make_consistent(agree);
//   }

#include <functional>
#include <optional>

#include "engine/ranks/window_repair.h"

namespace carom {

template <int D>
class Subdomain {
 public:
  /// `sizes` has the masses and radii of all spheres. All arguments must outlive the subdomain.
  Subdomain(const Box<D>& box, const Sizes& sizes, const SearchOptions& options, Communicator& ranks)
      : box_(box), ranks_(ranks), core_(box, &sizes, options) {}

  /// Appends a sphere to a message for load().
  void put_sphere(Bytes& to, const Record<D>& r, const Internal<D>& internal) const {
    put(to, r);
    if (box_.contacts.need_internal()) put(to, internal);
  }
  /// Starts at time `now` as the subdomain of a bisection that has this rank as number, with all spheres near it; it
  /// has none if there are fewer subdomains than ranks. In no window may a sphere move farther than
  /// `max_displacement`.
  void load(std::vector<Bytes> spheres, const Bisection<D>& bisection, const Vec<D>& g, double horizon, double now,
            double max_displacement);

  /// Frees the memory for plans, and release() that for spheres, until the next load().
  void stop() { core_.stop(); }
  void release();

  /// Own spheres, in the order of slots.
  std::vector<Slot> own() const { return ownership_->own(); }
  const Flights<D>& flights() const { return core_.flights(); }
  WindowPaths<D>& paths() { return *paths_; }

  // In a window. All functions but run() are collective.

  /// Runs from `now` to `end`. The window is invalid if a sphere moves farther than `max_displacement` from its start.
  /// Returns `end`, or the time of the first event for which the log has no room; the window is then invalid too.
  double run(double now, double end);
  /// Exchanges the paths of a window and repairs it, in rounds; returns their number. After every second round
  /// agree(changed) is called; `changed` says whether a path that a neighbour knows has changed here. If it returns
  /// true, two more rounds follow.
  std::uint64_t make_consistent(const std::function<bool(bool)>& agree);
  /// Ends the last window, updates ownership and ghosts, and sends neighbours the ghosts that
  /// they lack. Returns false if there was no room for a ghost: the next window is then invalid.
  bool begin_window();

  /// Calls visit(slot, k) for each node k that is a contact with its lower id owned here.
  template <class Visit>
  void for_each_contact(Visit&& visit) {
    paths_->for_each_own([&](Slot i) {
      for (std::size_t k = 1; k <= paths_->size(i); ++k)
        if (const Node<D> each = paths_->node(i, k); each.key.lo == each.after.id) visit(i, k);
    });
  }
  /// An upper limit of the contacts in paths().tally().
  std::uint64_t most_events() const { return paths_->trace().events().size() + counts.redone_events - redone_before_; }
  /// The largest speed of any sphere after an event.
  double fastest() const { return std::sqrt(paths_->trace().fastest_squared()); }

  EventCounts event_counts() const { return core_.counts(); }
  WindowCounts counts;  ///< since construction

 private:
  const std::vector<Bytes>& swap();

  const Box<D>& box_;
  Communicator& ranks_;
  EventCore<D> core_;
  std::optional<Ownership<D>> ownership_;
  std::optional<WindowPaths<D>> paths_;
  std::optional<WindowRepair<D>> repair_;
  double end_ = 0, length_ = 0;  // the present window
  std::vector<Slot> changed_;    // own spheres that are ghosts elsewhere and got new paths in the last run or repair
  std::uint64_t redone_before_ = 0;  // events of repairs before the present window
  std::vector<int> neighbours_;      // ranks of the neighbours
  std::vector<Bytes> outgoing_;      // for each of them
  std::vector<Bytes> received_;      // from each of them; their memory is used for the next outgoing messages
};

}  // namespace carom
