// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Repairs a window where paths of ghosts are not those that their owners sent.
//
// The path of such a ghost is cut at the first difference, and follows its script; spheres that it met, or meets now,
// are cut there and flown again, and so on in the order of keys, as far as the difference reaches. Contacts of a ghost
// with own spheres are decided here, not by its owner.

#include <deque>
#include <queue>

#include "engine/ranks/window_paths.h"

namespace carom {

template <int D>
class WindowRepair {
 public:
  /// All outlive this.
  WindowRepair(const Box<D>& box, EventCore<D>& core, const Ownership<D>& ownership, WindowPaths<D>& paths)
      : box_(box), core_(core), flights_(core.flights()), ownership_(ownership), paths_(paths) {}

  /// Makes room for so many slots.
  void load(std::size_t slots) { repair_of_.assign(slots, kNoRepair); }
  /// A window that ends at `end` starts.
  void start(double end) {
    end_ = end;
    fastest_squared_ = 0;
  }
  /// Repairs the paths after scripts have come. Returns the own spheres that have other paths than before.
  std::vector<Slot> run();

  /// The largest square of a speed after an event of the window.
  double fastest_squared() const { return fastest_squared_; }
  /// In all windows.
  std::uint64_t events() const { return events_; }

 private:
  static constexpr std::uint32_t kNoRepair = std::numeric_limits<std::uint32_t>::max();

  /// The repair of the path of a sphere.
  struct Repaired {
    Record<D> now;  // at the time that repair has come to
    Slot slot;
    std::uint32_t version = 0;           // grows with every change: what was planned before no longer holds
    bool left_script = false;            // a ghost that no longer follows its script
    std::size_t script = 0;              // the next node of its script
    std::size_t kept = 0;                // nodes of its old path that stand
    typename WindowPaths<D>::Nodes old;  // the others
  };
  /// What repair has to look at, in the order of keys.
  struct Task {
    enum class Kind : std::uint8_t { contact, script, check, difference } kind;
    EventKey<D> key;
    Slot a = 0, b = 0;  // b: of a contact with a sphere, and of a check
    std::uint32_t version_a = 0, version_b = 0;
    Image<D> image{};                          // of a contact, seen from a
    bool operator<(const Task& other) const {  // std::priority_queue keeps the largest on top
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
  Repaired& begin(Slot i, const EventKey<D>& key);
  void predict(Repaired& m, const EventKey<D>& now);
  void meet(Repaired& m, Slot j, const Image<D>& image, const EventKey<D>& now);
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
  double end_ = 0;  // of the window
  std::deque<Repaired> repairs_;
  std::vector<std::uint32_t> repair_of_;  // by slot: in repairs_, or kNoRepair
  std::priority_queue<Task> tasks_;
  double fastest_squared_ = 0;
  std::uint64_t events_ = 0;
};

}  // namespace carom
