#pragma once
// One subdomain of a system that is divided among several event cores, and what makes it agree with its neighbours.
//
// A subdomain owns the spheres in it and has copies of those near it, ghosts, which other subdomains own. Time goes in
// windows. In each the subdomain runs what it has as if there were no others, and records all paths. Then the owners
// send the paths of their spheres, which for the others are scripts of their ghosts; where a script differs from what
// was seen here the window is repaired, from the first difference on and only as far as that reaches, in the order of
// keys. Paths that have changed are sent again, until nothing changes: then every ghost was seen as its owner has it,
// and since a contact is a pure function of two records, all is as in a run by one core. (The smallest key at which any
// path is wrong grows with each round.)
//
//   subdomain.load(records, bisection, number, …);
//   subdomain.run(now, end);
//   while (…) { subdomain.follow(id, message); …; subdomain.repair(); … subdomain.changed() … }
//   subdomain.commit();
//   subdomain.sort_out(now, send); …; subdomain.admit(record, now);

#include <deque>
#include <queue>

#include "engine/base/contact_tally.h"
#include "engine/events/event_core.h"
#include "engine/ranks/bisection.h"
#include "engine/ranks/by_slot.h"
#include "engine/ranks/communicator.h"
#include "engine/ranks/id_table.h"

namespace carom {

template <int D>
class Subdomain {
 public:
  using Nodes = std::vector<Node<D>>;

  /// `sizes` has the masses and radii of all spheres, and outlives the subdomain.
  Subdomain(const Box<D>& box, const Sizes& sizes, const SearchOptions& options)
      : box_(box), core_(box, &sizes, options) {}

  /// Starts anew at time `now` as subdomain `number` of a bisection, with all spheres that concern it. In no window
  /// will a sphere come farther than `max_displacement`.
  void load(std::vector<Record<D>> records, const Bisection<D>& bisection, std::uint32_t number, const Vec<D>& g,
            double horizon, double now, double max_displacement);

  // Between windows, at a time `now` that no event precedes any more.

  /// Own spheres, all of them.
  std::vector<Slot> own() const;
  const Flights<D>& flights() const { return core_.flights(); }
  /// Updates ownership and ghosts, those here and those elsewhere; spheres that are neither own nor ghosts are removed.
  /// Calls send(k, record) for spheres that the k-th neighbour does not have yet and must admit.
  template <class Send>
  void sort_out(double now, Send&& send);
  /// Takes in a ghost; false: load anew, there is no room left.
  bool admit(const Record<D>& r, double now);

  // In a window.

  /// Runs from `now` to `end`. Where a sphere comes farther than `max_displacement` from its start the window is
  /// invalid: cut it before that. Returns the end, or the time of the first event for which the log has no room: it is
  /// invalid then, too.
  double run(double now, double end);
  /// Appends the path of a sphere to a message.
  void write_path(Slot i, Bytes& to) const;
  /// Reads the path of a ghost that its owner has sent; the message must stay until the end of the window.
  void follow(Id id, Reader& message);
  /// Mends the window after scripts have come.
  void repair();
  /// What a sphere did in the window.
  std::span<const Node<D>> path(Slot i) { return path_of(i).nodes; }
  /// The sphere before node k of its path.
  const Record<D>& before(Slot i, std::size_t k) {
    Path& path = path_of(i);
    return k > 0 ? path.nodes[k - 1].after : path.start;
  }
  /// The sphere after the last of them.
  const Record<D>& after(Slot i) const;
  /// Calls visit(slot) for each own sphere that had events at any time.
  template <class Visit>
  void for_each_touched(Visit&& visit) const;
  /// Own spheres that are ghosts elsewhere, and have other paths than before the last run() or repair().
  std::span<const Slot> changed() const { return changed_; }
  /// Which neighbours have an own sphere as a ghost: a bit for each.
  std::uint64_t holders(Slot i) const { return holders_[i]; }
  Slot slot_of(Id id) const { return slots_.find(id); }
  /// What own spheres did in a window; each collision counts where its lower id is owned.
  ContactTally tally() const;
  /// The largest speed of any sphere after an event.
  double fastest() const { return std::sqrt(std::max(trace_.fastest_squared(), mended_fastest_squared_)); }
  /// Whether, before a time, all ghosts have the same events here as with their owners.
  bool agrees(double end);
  /// Removes all events after `last`. The core is invalid then; load() again.
  void cut(const EventKey<D>& last);
  /// Ends the window.
  void commit();

  const EventCounts& counts() const { return core_.counts(); }
  std::uint64_t run_events() const { return run_events_; }        ///< of all first runs
  std::uint64_t redone_events() const { return redone_events_; }  ///< in repairs

 private:
  static constexpr std::uint32_t kNone = Trace<D>::kNone;
  static constexpr double kUnknown = -1;
  static constexpr double kSlack = 20;                        // windows between searches for spheres at the border
  enum class Role : std::uint8_t { none, own, seen, ghost };  // none: no sphere; seen: own, and a ghost elsewhere

  struct Edge {
    Slot slot;
    double quiet;             // how far it may come before it must be looked at again
    double speed = kUnknown;  // until its next event; unknown: as large as any
  };
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

  /// The repair of the path of a sphere.
  struct Mended {
    Record<D> now;  // at the time that repair has come to
    Slot slot;
    std::uint32_t version = 0;  // grows with every change: what was planned before no longer holds
    bool left_script = false;   // a ghost that no longer follows its script
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

  bool is_own(Slot i) const { return role_[i] == Role::own || role_[i] == Role::seen; }
  bool is_own_id(Id id) const;
  void enlist(Slot i, Id id, Role role);
  void forget(Slot i);
  void watch(double now);
  Edge look_at(Slot i, double now);
  void index();
  bool has_no_events(Slot i) const { return !paths_.has(i) && !trace_.has(i); }
  Path& path_of(Slot i);
  Path& rewritten(Slot i);
  EventKey<D> key_of(const typename Trace<D>::Event& event) const;
  Node<D> traced(Slot i, std::span<const std::uint32_t> entries, std::size_t k) const;
  std::span<const Node<D>> script_of(Slot g);
  bool matches(Slot g);
  bool mended(Slot i) const { return mended_of_[i] != kNone; }
  Mended& mend(Slot i, const EventKey<D>& key);
  void seed(Slot g);
  bool meeting_place(const Mended& m, Vec<D>& low, Vec<D>& high) const;
  bool follows_at_once(const Mended& m, const EventKey<D>& key);
  bool may_meet(const Mended& m, Slot j, const Image<D>& image) const;
  void predict(Mended& m, const EventKey<D>& now);
  void predict_walls(Mended& m);
  void meet(Mended& m, Slot j, const Image<D>& image, const EventKey<D>& now);
  void contact(const Task& task);
  void script(const Task& task);
  void check(const Task& task);
  void append(Mended& m, const Node<D>& node);
  void plan_script(Mended& m);
  std::uint32_t version(Slot i) const { return mended(i) ? repairs_[mended_of_[i]].version : 0; }

  const Box<D>& box_;
  EventCore<D> core_;
  double end_ = 0, length_ = 0, max_displacement_ = 0;  // of the window
  double unwatched_ = 0;                                // how far spheres may have come since watch()
  const Bisection<D>* bisection_ = nullptr;
  std::uint32_t number_ = 0;
  IdTable slots_;
  std::vector<Role> role_;              // by slot
  std::vector<std::uint64_t> holders_;  // by slot
  std::vector<Edge> edge_;              // ghosts, and own spheres that may leave, or that others may see

  Trace<D> trace_;
  BySlot<Path> paths_;                   // those that are wanted
  std::vector<std::uint8_t> rewritten_;  // by slot: its path is not that of the trace
  BySlot<Script> scripts_;               // of ghosts
  std::vector<Slot> touched_ghosts_;     // that had events in the first run
  std::vector<std::uint32_t> agreed_;    // by slot: the window in which the path of a ghost was found to be its script
  std::uint32_t window_ = 0;             // its number
  std::vector<Slot> changed_;
  std::vector<std::pair<Slot, Record<D>>> other_;  // records that differ from those of the core
  std::vector<std::uint8_t> disturbed_;            // by slot: it is among them
  double mended_fastest_squared_ = 0;

  std::deque<Mended> repairs_;
  std::vector<std::uint32_t> mended_of_;  // by slot: in repairs_, or kNone
  std::priority_queue<Task> tasks_;
  std::uint64_t run_events_ = 0, redone_events_ = 0;
};

template <int D>
template <class Send>
void Subdomain<D>::sort_out(double now, Send&& send) {
  if (unwatched_ += max_displacement_; unwatched_ > kSlack * max_displacement_) watch(now);
  std::size_t stay = 0;
  for (Edge edge : edge_) {
    const Slot i = edge.slot;
    if (edge.speed >= 0 && (trace_.has(i) || disturbed_[i] != 0)) edge.speed = kUnknown;
    edge.quiet -= edge.speed >= 0 ? edge.speed * length_ : max_displacement_;
    if (!(edge.quiet > 0)) {
      const std::uint64_t before = holders_[i];
      edge = look_at(i, now);
      if (role_[i] == Role::none) continue;
      for (std::uint64_t fresh = holders_[i] & ~before; fresh != 0; fresh &= fresh - 1)
        send(static_cast<std::size_t>(std::countr_zero(fresh)), core_.flights()[i]);
    }
    edge_[stay++] = edge;
  }
  for (const auto& [slot, record] : other_) disturbed_[slot] = 0;
  edge_.resize(stay);
}

template <int D>
template <class Visit>
void Subdomain<D>::for_each_touched(Visit&& visit) const {
  for (const auto& event : trace_.events())
    for (const int which : {0, 1})
      if (event.last[which] == kNone && event.slot[which] != kNone && is_own(event.slot[which]))
        visit(event.slot[which]);
  for (std::size_t k = 0; k < paths_.slots().size(); ++k)  // visit() may add paths
    if (const Slot i = paths_.slots()[k]; is_own(i) && rewritten_[i] != 0 && !trace_.has(i)) visit(i);
}

}  // namespace carom
