// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// What the spheres of a subdomain did in a window: their paths, and the scripts of its ghosts, which are the paths that
// their owners have sent.
//
// The event core writes a log (trace.h). A path is read from that where it is wanted, and stands by itself from then
// on; one that has been rewritten counts instead of what the log has.

#include "engine/base/bytes.h"
#include "engine/base/contact_tally.h"
#include "engine/events/trace.h"
#include "engine/ranks/by_slot.h"
#include "engine/ranks/ownership.h"

namespace carom {

template <int D>
class WindowPaths {
 public:
  using Nodes = std::vector<Node<D>>;

  /// `flights` are as the core left them at the end of the window. Both outlive this.
  WindowPaths(const Flights<D>& flights, const Ownership<D>& ownership) : flights_(flights), ownership_(ownership) {}

  /// Forgets all, and makes room for so many slots.
  void load(std::size_t slots);
  /// Starts a window; the core is to write its log there.
  Trace<D>& start();
  /// The log is complete. Returns the own spheres with events that are ghosts elsewhere.
  std::vector<Slot> end();
  /// Forgets the window; returns the records that are not those of the core.
  std::vector<std::pair<Slot, Record<D>>> finish();

  const Trace<D>& trace() const { return trace_; }
  bool has_no_events(Slot i) const { return !paths_.has(i) && !trace_.has(i); }
  std::span<const Node<D>> path(Slot i) { return path_of(i).nodes; }
  /// The sphere before node k of its path, and after the last one.
  const Record<D>& before(Slot i, std::size_t k) {
    Path& path = path_of(i);
    return k > 0 ? path.nodes[k - 1].after : path.start;
  }
  const Record<D>& after(Slot i) const;
  /// A path that is going to be changed.
  Nodes& rewrite(Slot i);
  /// Removes all events after `last`.
  void cut(const EventKey<D>& last);

  /// Appends the path of a sphere to a message.
  void write(Slot i, Bytes& to) const;
  /// Reads the script of a ghost; the message must stay until the end of the window.
  void read_script(Slot g, Reader& message);
  /// Of a ghost that had no events with its owner, nothing.
  std::span<const Node<D>> script(Slot g);
  /// Whether the path of a ghost here is its script.
  bool matches(Slot g);
  /// The same for all ghosts, before a time.
  bool agree(double end);

  /// Calls visit(slot) for each own sphere, or each ghost, that had events at any time, here or in its script. It may
  /// ask for paths.
  template <class Visit>
  void for_each_own(Visit&& visit) const;
  template <class Visit>
  void for_each_ghost(Visit&& visit) const;
  /// Of own spheres; each collision counts where its lower id is owned.
  ContactTally tally() const;

 private:
  static constexpr std::uint32_t kNoEntry = Trace<D>::kNoEntry;
  struct Path {
    Record<D> start;  // at the start of the window
    Nodes nodes;
  };
  /// Of a ghost. Most are compared with what was seen and never read.
  struct Script {
    const std::byte* bytes;
    std::uint32_t count;
    Nodes nodes;  // where they have been read
    Node<D> node(std::size_t k) const;
  };
  /// A path where it stands, or as the log has it; good until another one is looked at.
  struct View {
    const WindowPaths& all;
    Slot slot;
    const Nodes* nodes;  // null: read from the log
    std::span<const std::uint32_t> entries;
    std::uint32_t size() const { return static_cast<std::uint32_t>(nodes ? nodes->size() : entries.size()); }
    Node<D> node(std::size_t k) const { return nodes ? (*nodes)[k] : all.logged(slot, entries, k); }
  };

  View view(Slot i) const {
    if (paths_.has(i)) return {*this, i, &paths_.at(i).nodes, {}};
    return {*this, i, nullptr, trace_.entries(i)};
  }
  Node<D> logged(Slot i, std::span<const std::uint32_t> entries, std::size_t k) const;
  Path& path_of(Slot i);

  const Flights<D>& flights_;
  const Ownership<D>& ownership_;
  Trace<D> trace_;
  BySlot<Path> paths_;                   // those that are wanted
  std::vector<std::uint8_t> rewritten_;  // by slot: its path is not that of the trace
  BySlot<Script> scripts_;               // of ghosts
  std::vector<Slot> touched_ghosts_;     // that had events in the log
  std::vector<std::uint32_t> agreed_;    // by slot: the window in which the path of a ghost was found to be its script
  std::uint32_t window_ = 0;             // its number
};

template <int D>
template <class Visit>
void WindowPaths<D>::for_each_own(Visit&& visit) const {
  for (const auto& event : trace_.events())
    for (const int which : {0, 1})
      if (const Slot i = event.slot[which]; event.last[which] == kNoEntry && i != kNoEntry && ownership_.owns(i))
        visit(i);
  for (std::size_t k = 0; k < paths_.slots().size(); ++k)  // visit() may add paths
    if (const Slot i = paths_.slots()[k]; ownership_.owns(i) && rewritten_[i] != 0 && !trace_.has(i)) visit(i);
}

template <int D>
template <class Visit>
void WindowPaths<D>::for_each_ghost(Visit&& visit) const {
  for (const Slot g : scripts_.slots()) visit(g);
  for (const Slot g : touched_ghosts_)
    if (!scripts_.has(g)) visit(g);
  for (std::size_t k = 0; k < paths_.slots().size(); ++k)
    if (const Slot g = paths_.slots()[k]; ownership_.is_ghost(g) && !scripts_.has(g) && !trace_.has(g)) visit(g);
}

}  // namespace carom
