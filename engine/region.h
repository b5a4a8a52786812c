#pragma once
// One region of a system that is divided among several event cores, and what makes it agree with its neighbours.
//
// A region owns the spheres in it and has copies of those near it, ghosts, which other regions own. Time goes in
// windows. In each the region runs what it has as if nobody else were there, and writes down everybody's path. Then
// the owners send the paths of their spheres, which for the others are scripts of their ghosts; where a script differs
// from what was seen here the window is repaired, from the first difference on and only as far as that reaches, in the
// order of keys. Paths that have changed are sent again, until nothing changes: then every ghost was seen as its owner
// has it, and since a contact is a pure function of two records, all is as in a run by one core. (The smallest key at
// which anybody is wrong grows with each round.)
//
//   region.load(own, ghosts, g, horizon, now, stray);
//   region.run(now, end);
//   while (…) { region.follow(id, script); …; region.repair(); … region.changed() … }
//   region.commit();

#include <deque>
#include <functional>
#include <queue>
#include <unordered_map>

#include "engine/event_core.h"

namespace carom {

template <int D>
class Region {
 public:
  using Nodes = std::vector<Node<D>>;

  /// `particles` tells masses and radii of everybody, by id.
  Region(const Box<D>& box, const Particles<D>& particles, const SearchOptions& options)
      : box_(box), core_(box, particles, options) {}

  /// Starts anew at time `now` with own spheres and ghosts. In no window will anyone come farther than `stray`.
  void load(std::vector<Record<D>> own, const std::vector<Record<D>>& ghosts, const Vec<D>& g, double horizon,
            double now, double stray);

  // Between windows, at a time `now` that no event precedes any more.

  /// Own spheres, all of them.
  std::vector<Slot> own() const;
  /// Those of them that may leave, or that others may see: the last word of watch().
  std::span<const Slot> border() const { return border_; }
  const Flights<D>& flights() const { return core_.flights(); }
  bool has(Id id) const { return slot_.contains(id); }
  bool owns(Slot i) const { return role_[i] == Role::own; }
  Slot slot_of(Id id) const { return slot_.at(id); }
  /// Says anew who of the border and the ghosts is whose: owns(x) and wants(x) tell, of a position at `now`, whether a
  /// sphere there is this region's own, or one of its ghosts. Others are forgotten.
  template <class Owns, class Wants>
  void sort_out(double now, Owns&& owns, Wants&& wants) {
    all_.swap(border_);
    all_.insert(all_.end(), ghosts_.begin(), ghosts_.end());
    border_.clear();
    ghosts_.clear();
    for (const Slot i : all_) {
      const Vec<D> x = core_.flights().at(i, now).x;
      if (owns(x)) {
        role_[i] = Role::own;
        border_.push_back(i);
      } else if (wants(x)) {
        role_[i] = Role::ghost;
        ghosts_.push_back(i);
      } else {
        forget(i);
      }
    }
  }
  /// Says anew who is at the border: near(x) tells it, of a position at `now`.
  void watch(double now, const std::function<bool(const Vec<D>&)>& near);
  /// Takes in a ghost; false: load anew, there is no room left.
  bool admit(const Record<D>& r, double now);

  // In a window.

  /// Runs from `now` to `end`. Whoever comes farther than the stray from where he was at `now` makes it of no use: cut
  /// it before that.
  void run(double now, double end);
  /// What a ghost did according to its owner.
  void follow(Id id, Nodes script);
  /// Mends the window after scripts have come.
  void repair();
  /// What a sphere did in the window.
  std::span<const Node<D>> path(Slot i) const;
  /// The sphere before node k of its path.
  const Record<D>& before(Slot i, std::size_t k) const;
  /// The sphere after the last of them.
  const Record<D>& after(Slot i) const;
  /// Spheres that had events at any time, ghosts among them.
  std::span<const Slot> touched() const { return touched_; }
  /// Own spheres whose paths are not what they were before the last run() or repair().
  std::span<const Slot> changed() const { return changed_; }
  /// Whether all ghosts did here what they did at their owners'.
  bool agrees() const;
  /// Forgets all events after `last`. The core is of no use then; load() again.
  void cut(const EventKey<D>& last);
  /// Ends the window.
  void commit();

  const EventCounts& counts() const { return core_.counts(); }
  std::uint64_t run_events() const { return run_events_; }        ///< of all first runs
  std::uint64_t redone_events() const { return redone_events_; }  ///< in repairs

 private:
  static constexpr std::uint32_t kNone = 0xffffffff;
  enum class Role : std::uint8_t { nobody, own, ghost };

  /// Paths of a few spheres.
  class Store {
   public:
    void resize(std::size_t slots) { index_.resize(slots, kNone); }
    bool has(Slot i) const { return index_[i] != kNone; }
    Nodes& operator[](Slot i) {
      if (!has(i)) {
        index_[i] = static_cast<std::uint32_t>(who_.size());
        who_.push_back(i);
        if (paths_.size() < who_.size()) paths_.emplace_back();
        paths_[index_[i]].clear();
      }
      return paths_[index_[i]];
    }
    std::span<const Node<D>> at(Slot i) const {
      return has(i) ? std::span<const Node<D>>(paths_[index_[i]]) : std::span<const Node<D>>();
    }
    std::span<const Slot> who() const { return who_; }
    void clear() {
      for (const Slot i : who_) index_[i] = kNone;
      who_.clear();
    }

   private:
    std::vector<std::uint32_t> index_;  // by slot
    std::vector<Slot> who_;
    std::deque<Nodes> paths_;  // kept for their memory
  };

  /// A sphere whose path is being mended.
  struct Mended {
    Slot slot;
    Record<D> now;              // at the time that repair has come to
    std::uint32_t version = 0;  // grows with every change: what was planned before no longer holds
    bool strays = false;        // a ghost that no longer does what its script says
    std::size_t script = 0;     // the next node of its script
    std::size_t kept = 0;       // nodes of its old path that stand
    Nodes old;                  // the others
  };
  /// What repair has to look at, in the order of keys.
  struct Task {
    enum class Kind : std::uint8_t { contact, script, check, seed } kind;
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

  void enlist(Slot i, Id id, Role role);
  void forget(Slot i);
  void index();
  bool mended(Slot i) const { return mended_of_[i] != kNone; }
  Mended& mend(Slot i, const EventKey<D>& key);
  void seed(Slot g);
  void predict(Mended& m, const EventKey<D>& now);
  void predict_walls(Mended& m);
  void meet(Mended& m, Slot j, const Image<D>& image, const EventKey<D>& now);
  void contact(const Task& task);
  void script(const Task& task);
  void check(const Task& task);
  void append(Mended& m, const Node<D>& node);
  void plan_script(Mended& m);
  std::uint32_t version(Slot i) const { return mended(i) ? repairs_[mended_of_[i]].version : 0; }
  bool is_own(Id id) const;
  Nodes& rewritten(Slot i);

  const Box<D>& box_;
  EventCore<D> core_;
  double end_ = 0, stray_ = 0;  // of the window
  std::unordered_map<Id, Slot> slot_;
  std::vector<Role> role_;  // by slot
  std::vector<Slot> border_, ghosts_, all_;

  Trace<D> trace_;
  std::vector<Record<D>> start_;               // at the start of the window, of those who had events
  Nodes nodes_;                                // of the first run, by sphere
  std::vector<std::uint32_t> first_, length_;  // by slot: in nodes_
  std::vector<std::uint32_t> start_of_;        // by slot: in start_, or kNone
  std::vector<Slot> touched_, changed_;
  Store rewritten_;                                // paths that have been mended
  Store script_;                                   // of ghosts
  std::vector<std::pair<Slot, Record<D>>> other_;  // records that the core is told

  std::deque<Mended> repairs_;
  std::vector<std::uint32_t> mended_of_;  // by slot: in repairs_, or kNone
  std::priority_queue<Task> tasks_;
  std::uint64_t run_events_ = 0, redone_events_ = 0;
};

}  // namespace carom
