// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The paths of a subdomain's spheres in a window, and the scripts of its ghosts: the paths received from their owners.
//
// The event core writes a log (trace.h), from which paths are read on demand and then stored. A rewritten path replaces
// the one in the log.

#include "engine/base/bytes.h"
#include "engine/events/trace.h"
#include "engine/laws/contact_tally.h"
#include "engine/ranks/by_slot.h"
#include "engine/ranks/ownership.h"

namespace carom {

template <int D>
class WindowPaths {
 public:
  /// A path: the sphere at the start of the window, then after each event.
  using Nodes = std::vector<Node<D>>;

  /// For the loaded spheres of a core, in the state the core left at the end of the window. All arguments must outlive
  /// this object.
  WindowPaths(const Box<D>& box, const Flights<D>& flights, Ownership<D>& ownership)
      : box_(box),
        flights_(flights),
        ownership_(ownership),
        paths_(flights.capacity()),
        scripts_(flights.capacity()),
        listed_(flights.capacity()) {}

  /// Starts a window; the core must write to the returned log.
  Trace<D>& start_log();
  /// Call when the log is complete; tells the ownership about spheres with events. Returns the own spheres with events
  /// that are ghosts elsewhere.
  std::vector<Slot> link_log();
  /// Ends the window; returns the records that differ from the core's.
  std::vector<typename EventCore<D>::Changed> take_changes();

  const Trace<D>& trace() const { return trace_; }
  bool has_no_events(Slot i) const { return !paths_.has(i) && !trace_.has(i); }
  /// The path of a sphere, which may be changed; stored from now on.
  Nodes& path(Slot i);
  /// The path after its start.
  std::span<const Node<D>> events(Slot i) { return std::span<const Node<D>>(path(i)).subspan(1); }
  /// Appends an event to a path.
  void append(Slot i, const Node<D>& node) {
    path(i).push_back(node);
    trace_.note_speed(node.after);
  }
  /// The number of events of a path, and its nodes from 0, the start, on; stores no path.
  std::size_t size(Slot i) const { return view(i).size(); }
  Node<D> node(Slot i, std::size_t k) const { return view(i).node(k); }
  /// The sphere after its last event.
  const Record<D>& after(Slot i) const { return paths_.has(i) ? paths_.at(i).back().after : flights_[i]; }
  Internal<D> internal_after(Slot i) const {
    return paths_.has(i) ? paths_.at(i).back().internal : flights_.internal(i);
  }
  /// Removes all events after `last`.
  void cut(const EventKey<D>& last);

  /// Appends the path of a sphere to a message.
  void write(Slot i, Bytes& to) const;
  /// Reads the script of a ghost.
  void read_script(Reader& message);
  /// The script of a ghost; empty if it had no events on its owner.
  std::span<const Node<D>> script(Slot g) const {
    return scripts_.has(g) ? std::span<const Node<D>>(scripts_.at(g)) : std::span<const Node<D>>();
  }
  /// Whether the path of a ghost equals its script.
  bool matches(Slot g) const;
  /// Removes and returns the ghosts whose path or script is new since they last matched. Add those back that do not
  /// match, and those with rewritten paths.
  std::vector<Slot> take_unmatched() {
    for (const Slot g : unmatched_) listed_[g] = 0;
    return std::exchange(unmatched_, {});
  }
  void add_unmatched(Slot g) {
    if (std::exchange(listed_[g], 1) == 0) unmatched_.push_back(g);
  }
  /// Whether the paths of all ghosts equal their scripts.
  bool all_match() const {
    return std::ranges::all_of(unmatched_, [&](Slot g) { return matches(g); });
  }

  /// Calls visit(slot) for each own sphere that had events in any version of the window, and perhaps others. visit()
  /// may call path().
  template <class Visit>
  void for_each_own(Visit&& visit) const;
  /// The contacts of own spheres; each counts where its lower id is owned.
  ContactTally tally() const;
  /// The contact in node k of the path of the sphere with the lower id.
  Contact<D> contact_of(Slot lo, std::size_t k) const;

 private:
  static constexpr std::uint32_t kNoEntry = Trace<D>::kNoEntry;
  struct ScriptHead {
    Id id;
    std::uint32_t nodes;
  };
  /// A path, stored or read from the log; valid until another path is viewed.
  struct View {
    const WindowPaths& all;
    Slot slot;
    const Nodes* nodes;  // null: read from the log
    std::span<const std::uint32_t> entries;
    std::uint32_t size() const { return static_cast<std::uint32_t>(nodes ? nodes->size() - 1 : entries.size()); }
    Node<D> node(std::size_t k) const { return nodes ? (*nodes)[k] : all.logged(slot, entries, k); }
  };

  [[gnu::always_inline]] View view(Slot i) const {
    if (paths_.has(i)) return {*this, i, &paths_.at(i), {}};
    return {*this, i, nullptr, trace_.entries(i)};
  }
  /// The bytes of a node in a message: without the internal state if spheres have none.
  std::size_t node_bytes() const {
    return offsetof(Node<D>, internal) + (flights_.has_internal() ? sizeof(Internal<D>) : 0);
  }
  EventKey<D> key_of(std::uint32_t entry) const;
  Node<D> logged(Slot i, std::span<const std::uint32_t> entries, std::size_t k) const;

  const Box<D>& box_;
  const Flights<D>& flights_;
  Ownership<D>& ownership_;
  Trace<D> trace_;
  BySlot<Nodes> paths_;    // stored paths
  BySlot<Nodes> scripts_;  // without starts
  std::vector<Slot> unmatched_;
  std::vector<std::uint8_t> listed_;  // by slot: whether it is in unmatched_
};

template <int D>
template <class Visit>
void WindowPaths<D>::for_each_own(Visit&& visit) const {
  for (const auto& event : trace_.events())
    for (const int which : {0, 1})
      if (const Slot i = event.slot[which]; event.last[which] == kNoEntry && i != kNoEntry && ownership_.owns(i))
        visit(i);
  for (std::size_t k = 0; k < paths_.slots().size(); ++k)  // visit() may add paths
    if (const Slot i = paths_.slots()[k]; ownership_.owns(i) && !trace_.has(i)) visit(i);
}

}  // namespace carom
