// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Repairs a window in which ghosts have moved differently from the paths that their owners sent.
//
// The path of the ghost is cut at the first difference and then follows its script. Spheres that met it, or meet it
// now, are cut there and advanced again, and so on in the order of keys, as far as the difference propagates. Contacts
// of a ghost with own spheres are decided here, not by its owner.

#include <deque>
#include <queue>

#include "engine/ranks/window_paths.h"

namespace carom {

template <int D>
class WindowRepair {
 public:
  /// All arguments must outlive this object.
  WindowRepair(const Box<D>& box, EventCore<D>& core, const Ownership<D>& ownership, WindowPaths<D>& paths)
      : box_(box), core_(core), flights_(core.flights()), ownership_(ownership), paths_(paths) {}

  /// Makes room for this many slots.
  void load(std::size_t slots) { repair_of_.assign(slots, kNoRepair); }
  void start(double end) {
    end_ = end;
    fastest_squared_ = 0;
  }
  /// Repairs the paths after scripts were received. Returns the own spheres with changed paths.
  std::vector<Slot> run();

  /// The largest squared speed after an event of the window.
  double fastest_squared() const { return fastest_squared_; }
  /// Number of events in all repairs.
  std::uint64_t events() const { return events_; }

 private:
  static constexpr std::uint32_t kNoRepair = std::numeric_limits<std::uint32_t>::max();

  /// The repair of one sphere's path.
  struct Repaired {
    Record<D> now;  // at the time that the repair has reached
    Spin<D> spin;   // there
    Slot slot;
    std::uint32_t version = 0;           // incremented with every change; older plans are invalid
    bool left_script = false;            // a ghost that no longer follows its script
    std::size_t script = 0;              // index of the next node of its script
    std::size_t kept = 0;                // nodes of the old path that remain
    typename WindowPaths<D>::Nodes old;  // removed nodes
  };
  /// A task of the repair; tasks are in the order of keys.
  struct Task {
    enum class Kind : std::uint8_t { contact, script, check, difference } kind;
    EventKey<D> key;
    Slot a = 0, b = 0;  // b: partner of a contact, or sphere to check
    std::uint32_t version_a = 0, version_b = 0;
    Image<D> image{};                          // image of the partner in a contact, relative to a
    bool operator<(const Task& other) const {  // std::priority_queue has the largest on top
      if (other.key < key) return true;
      if (key < other.key) return false;
      return other.kind < kind;
    }
  };

  bool repaired(Slot i) const { return repair_of_[i] != kNoRepair; }
  Repaired& repaired_at(Slot i, const EventKey<D>& key) {
    return repaired(i) ? repairs_[repair_of_[i]] : begin(i, key);
  }
  std::uint32_t version(Slot i) const { return repaired(i) ? repairs_[repair_of_[i]].version : 0; }
  const Node<D>* next_of_script(const Repaired& m);
  void compare(Slot g);
  bool adopt(Slot g);
  Repaired& begin(Slot i, const EventKey<D>& key);
  void predict(Repaired& m, const EventKey<D>& now);
  template <class Wanted, class Visit>
  bool visit_near(Slot i, const Record<D>& r, Wanted&& wanted, Visit&& visit);
  bool meets(Slot i, const Record<D>& r, Slot j, const Image<D>& image, const EventKey<D>& now, EventKey<D>& key);
  void contact(const Task& task);
  void script(const Task& task);
  void check(const Task& task);
  void append(Repaired& m, const Node<D>& node);
  void plan_script(Repaired& m);

  const Box<D>& box_;
  EventCore<D>& core_;
  const Flights<D>& flights_;
  const Ownership<D>& ownership_;
  WindowPaths<D>& paths_;
  double end_ = 0;  // end of the window
  std::deque<Repaired> repairs_;
  std::vector<std::uint32_t> repair_of_;  // by slot: index in repairs_, or kNoRepair
  std::priority_queue<Task> tasks_;
  double fastest_squared_ = 0;
  std::uint64_t events_ = 0;
};

}  // namespace carom
