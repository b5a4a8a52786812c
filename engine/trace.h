#pragma once
// Paths of the spheres through a window of time, as the event core writes them down.

#include <limits>
#include <vector>

#include "engine/contact_log.h"
#include "engine/record.h"

namespace carom {

/// An event of one sphere, and the sphere after it.
template <int D>
struct Node {
  Record<D> after;
  EventKey<D> key;
  double virial = 0;   ///< d·impulse of a pair collision [mass·length²/time]
  double overlap = 0;  ///< at contact, relative to the contact distance
  Slot slot = 0;       ///< of the sphere, where the node was written down

  /// The other sphere's id; kNoPartner at a wall.
  static constexpr Id kNoPartner = std::numeric_limits<Id>::max();
  Id partner() const {
    if (key.kind == EventKind::wall) return kNoPartner;
    return key.lo == after.id ? key.hi : key.lo;
  }
};

/// Whether two nodes are the same, bit for bit.
template <int D>
bool operator==(const Node<D>& a, const Node<D>& b) {
  return a.key == b.key && a.after.x == b.after.x && a.after.v == b.after.v && a.after.t == b.after.t &&
         a.after.id == b.after.id;
}

/// What happened in a window, in the order of keys: the nodes of all spheres, and what they were at its start.
template <int D>
struct Trace {
  struct Start {
    Slot slot;
    Record<D> record;
  };
  double start = 0;  ///< of the window, since that of the epoch
  std::vector<Start> starts;
  std::vector<Node<D>> nodes;

  /// Whether a record is from before the window.
  bool before(const Record<D>& r) const { return r.t < start || (r.t == 0 && r.generation == 0); }
  void clear(double window_start) {
    start = window_start;
    starts.clear();
    nodes.clear();
  }
};

}  // namespace carom
