// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Repairs a window in which ghosts have moved differently from the paths that their owners sent.
//
// The path of the ghost is cut at the first difference and then follows its script. Spheres that met it, or meet it
// now, are cut there and advanced again, and so on in the order of keys, as far as the difference propagates. Contacts
// of a ghost with own spheres are decided here, not by its owner.

#include <queue>

#include "engine/ranks/window_paths.h"

namespace carom {

template <int D>
class WindowRepair {
 public:
  /// For the loaded spheres of a core. All arguments must outlive this object.
  WindowRepair(const Box<D>& box, EventCore<D>& core, const Ownership<D>& ownership, WindowPaths<D>& paths)
      : box_(box),
        core_(core),
        flights_(core.flights()),
        ownership_(ownership),
        paths_(paths),
        repairs_(flights_.capacity()) {}

  /// Repairs the paths of the window up to `end` after scripts were received. Returns the own spheres with changed
  /// paths.
  std::vector<Slot> run(double end);
  /// Number of events in the last repair.
  std::uint64_t events() const { return events_; }

 private:
  /// The repair of one sphere's path.
  struct Repaired {
    Slot slot;
    std::uint32_t version;               // incremented with every change; older plans are invalid
    bool left_script;                    // a ghost that no longer follows its script
    typename WindowPaths<D>::Nodes old;  // the path before
  };
  /// A task of the repair; tasks are in the order of keys.
  struct Task {
    enum class Kind : std::uint8_t { contact, script, difference } kind;
    EventKey<D> key;
    Slot a = 0, b = 0;  // b: partner of a contact
    std::uint32_t version_a = 0, version_b = 0;
    Image<D> image{};                          // image of the partner in a contact, relative to a
    bool operator<(const Task& other) const {  // std::priority_queue has the largest on top
      if (other.key < key) return true;
      if (key < other.key) return false;
      return other.kind < kind;
    }
  };

  Repaired& repaired_at(Slot i, const EventKey<D>& key) { return repairs_.has(i) ? repairs_.at(i) : begin(i, key); }
  std::uint32_t version(Slot i) const { return repairs_.has(i) ? repairs_.at(i).version : 0; }
  const Node<D>* next_of_script(const Repaired& m);
  void compare(Slot g);
  bool adopt(Slot g);
  Repaired& begin(Slot i, const EventKey<D>& key);
  void predict(const Repaired& m, const EventKey<D>& now);
  template <class Wanted, class Visit>
  bool visit_near(Slot i, const Record<D>& r, Wanted&& wanted, Visit&& visit);
  bool meets(Slot i, const Record<D>& r, Slot j, const Image<D>& image, const EventKey<D>& now, EventKey<D>& key);
  void contact(const Task& task);
  void script(const Task& task);
  void difference(const Task& task);
  void append(Repaired& m, const Node<D>& node);
  void plan_script(const Repaired& m);

  const Box<D>& box_;
  EventCore<D>& core_;
  const Flights<D>& flights_;
  const Ownership<D>& ownership_;
  WindowPaths<D>& paths_;
  double end_ = 0;  // end of the window
  BySlot<Repaired> repairs_;
  std::priority_queue<Task> tasks_;
  std::uint64_t events_ = 0;
};

}  // namespace carom
