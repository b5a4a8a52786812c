#pragma once
// Runs one slab event by event, each particle on parabolas of its own, and writes down its history.
//
// The core knows contacts; what happens to a flight at a node is the integrator's rule: with which velocity a particle
// arrives, with which acceleration it goes on. A collision is a node of the colliders only and costs what their
// surroundings cost. Pairs out of reach until the slab's end are never predicted: the queue holds only what can happen.
//
//   core.begin(x, margin);                   // pairs that may meet while nobody strays farther than margin
//   histories.reset(length, x, v);           // and their accelerations: first flights
//   auto run = core.run(histories, rule, extra_nodes);
//   // … other accelerations of the first intervals
//   run = core.run(histories, rule, extra_nodes);            // everybody again
//   run = core.repair(histories, rule, extra_nodes, seeds);  // or what can have changed, where few have others
//
// A repair wakes the seeds and everybody whom they met, directly or by others: these lose what they did, and are run
// again among each other and past the recorded intervals of everybody else. Whoever meets one who sleeps wakes him from
// that event on, with everybody whom he has met; what they did before it stays. A contact is a function of the two
// flights alone, so that what comes out is, bit for bit, what a run of everybody gives.
//
// Contacts at one instant share a node, so no interval has zero length. A contact without any approach that would come
// again without end, and a blow to a sphere held in a resting contact, are for everybody: the run stops there, and the
// slab has to end at that time (see ContactScan::resolve, which then sees to them).

#include "engine/contact_scan.h"
#include "engine/histories.h"

namespace carom {

/// What an integrator decides at a node.
template <int D>
class NodeRule {
 public:
  virtual ~NodeRule() = default;
  /// Particle i ends its last interval at time t with the event `key`: gives the velocity with which it arrives, before
  /// any collision, and the acceleration of its next flight.
  virtual void node(const Histories<D>& paths, Id i, double t, const EventKey<D>& key, Vec<D>& v, Vec<D>& a) = 0;
  /// Particle i has been cut; what it did before its interval `past` stays, and it goes on from there.
  virtual void woken(Id /*i*/, std::uint32_t /*past*/) {}
};

/// A node without a collision.
struct ExtraNode {
  Id who;
  double time;
};

/// The event that stands for an extra node in histories: a wall that is none.
template <int D>
EventKey<D> extra_node_key(const ExtraNode& node) {
  return {.time = node.time, .kind = EventKind::wall, .lo = node.who, .hi = 2 * D};
}
template <int D>
bool is_extra(const EventKey<D>& key) {
  return key.kind == EventKind::wall && key.hi == 2 * D;
}

/// How a run of the core ended.
template <int D>
struct SlabRun {
  enum class End {
    complete,
    cut,      ///< the slab must end at `time` for everybody
    strayed,  ///< someone left the margin; begin() again with one of at least `margin`
    crowded,  ///< more events than a slab may have
    lost      ///< a repair met what it cannot tell apart; histories are as before, and everybody is to be run
  };
  End end = End::complete;
  double time = 0, margin = 0;
  EventKey<D> key{};  ///< the event behind a cut or a crowd
};

template <int D>
class SlabCore {
 public:
  SlabCore(const System<D>& system, ContactScan<D>& scan, std::uint64_t max_events);

  /// The pairs of a slab from x in which nobody strays farther than `margin`.
  void begin(Positions<D> x, double margin);

  /// Runs everybody from the first intervals in `paths` to the end of the slab.
  SlabRun<D> run(Histories<D>& paths, NodeRule<D>& rule, std::span<const ExtraNode> extra = {});

  /// The same after a run that was complete, where only the accelerations of the seeds have changed since, or what the
  /// rule says of them. Not where contacts rest.
  SlabRun<D> repair(Histories<D>& paths, NodeRule<D>& rule, std::span<const ExtraNode> extra,
                    std::span<const Id> seeds);

  /// Whom the last repair has run again.
  std::span<const Id> awake() const { return awake_; }

  /// The collisions of the last run, in the order of their keys.
  std::span<const Contact<D>> contacts() const { return contacts_; }

 private:
  struct Planned {
    EventKey<D> key;
    std::uint32_t version_lo = 0, version_hi = 0;  ///< of the flights that it is planned for; extra nodes: of none
    bool operator<(const Planned& other) const { return other.key < key; }  // the standard heap serves the largest
  };

  void plan(const Planned& event);
  bool next_event(const Histories<D>& paths, Planned& event);
  void prefetch_upcoming(const Histories<D>& paths) const;
  SlabRun<D> serve(Histories<D>& paths, NodeRule<D>& rule, std::span<const ExtraNode> extra);
  bool wake(Histories<D>& paths, NodeRule<D>& rule, std::span<const Id> who, std::span<const ExtraNode> extra,
            const EventKey<D>* now);
  void sleep(Histories<D>& paths, bool restore);
  bool asleep(Id i) const { return repairs_ && waking_[i] == 0; }
  void predict_pair(const Histories<D>& paths, Id i, Id j, const Image<D>& image);
  bool predict_between(const Histories<D>& paths, Id i, Id j, std::uint32_t m, std::uint32_t n, const Image<D>& image);
  void predict_walls(const Histories<D>& paths, Id i);
  void predict_all(const Histories<D>& paths, Id i);
  void predict_first(const Histories<D>& paths);
  bool near(const Histories<D>& paths, const NeighbourPair<D>& pair, double path) const;
  bool stale(const Planned& event) const;
  void open(Histories<D>& paths, NodeRule<D>& rule, Id i, const EventKey<D>& key);
  double approach(const Histories<D>& paths, const EventKey<D>& key) const;
  void collide(Histories<D>& paths, const EventKey<D>& key);
  std::uint32_t generation(const Histories<D>& paths, Id i, std::uint32_t n, double t) const;
  double reach(const Histories<D>& paths, std::uint32_t n) const;

  static constexpr double kRoom = 1.25;  // for first flights that change, in parts of their reach

  const Box<D>& box_;
  const Particles<D>& particles_;
  ContactScan<D>& scan_;
  std::uint64_t max_events_;
  std::span<const NeighbourPair<D>> pairs_;
  double margin_ = 0;
  bool walls_;
  std::vector<double> reach_;        // the farthest first flights for which `near_` holds
  std::vector<std::uint32_t> near_;  // among the pairs: those that may meet on first flights
  bool near_known_ = false;
  std::vector<Id> beyond_;  // who flies farther
  std::vector<std::uint32_t> version_;
  std::vector<char> held_;
  std::vector<Planned> first_;  // planned before the service began, sorted
  std::size_t served_ = 0;      // of these
  std::vector<Planned> queue_;  // a heap of what was planned since
  bool serving_ = false;
  std::vector<Contact<D>> contacts_;
  // Of repairs:
  bool repairs_ = false, lost_ = false;
  std::vector<std::array<Id, 2>> met_;  // who has met whom since the last run of everybody, and perhaps no longer does
  std::size_t met_before_ = 0;          // these of them are sorted: from before the repair
  std::vector<std::uint32_t> waking_;   // by particle: 1 + its place in awake_, or 0
  std::vector<Id> awake_;
  std::vector<EventKey<D>> since_;  // by place in awake_: the event by which it was woken; time -1: the seeds
};

}  // namespace carom
