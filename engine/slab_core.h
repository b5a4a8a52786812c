#pragma once
// Runs one slab event by event, each particle on parabolas of its own, and writes down its history.
//
// The core knows contacts; what happens to a flight at a node is the integrator's rule: with which velocity a particle
// arrives, with which acceleration it goes on. A collision is a node of the colliders only and costs what their
// surroundings cost. Pairs out of reach until the slab's end are never predicted: the queue holds only what can happen.
//
//   core.begin(x, margin);                   // pairs that may meet while nobody strays farther than margin
//   histories.reset(length, x, v, a);        // first flights
//   const auto run = core.run(histories, rule, extra_nodes);
//
// Contacts at one instant share a node, so no interval has zero length. A contact without any approach that would come
// again without end, and a blow to a sphere held in a resting contact, are for everybody: the run stops there, and the
// slab has to end at that time (see ContactScan::resolve, which then sees to them).

#include "engine/contact_scan.h"
#include "engine/histories.h"
#include "engine/partners.h"

namespace carom {

/// What an integrator decides at a node.
template <int D>
class NodeRule {
 public:
  virtual ~NodeRule() = default;
  /// Particle i ends its last interval at time t with the event `key`: gives the velocity with which it arrives, before
  /// any collision, and the acceleration of its next flight.
  virtual void node(const Histories<D>& paths, Id i, double t, const EventKey<D>& key, Vec<D>& v, Vec<D>& a) = 0;
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
    crowded   ///< more events than a slab may have
  };
  End end = End::complete;
  double time = 0, margin = 0;
  EventKey<D> key{};  ///< the event behind a cut or a crowd
};

template <int D>
class SlabCore {
 public:
  SlabCore(const System<D>& system, ContactScan<D>& scan, std::uint64_t max_events)
      : box_(system.box), particles_(system.particles), scan_(scan), max_events_(max_events) {}

  /// The pairs of a slab from x in which nobody strays farther than `margin`.
  void begin(Positions<D> x, double margin);

  /// Runs from the first intervals in `paths` to the end of the slab. Call close() on them before use.
  SlabRun<D> run(Histories<D>& paths, NodeRule<D>& rule, std::span<const ExtraNode> extra = {});

  /// The collisions of the last run, in the order of their keys.
  std::span<const Contact<D>> contacts() const { return contacts_; }

 private:
  struct Planned {
    EventKey<D> key;
    std::uint32_t version_lo, version_hi;
    bool extra;
    bool operator<(const Planned& other) const { return other.key < key; }  // the standard heap serves the largest
  };

  const Partners& partners();
  void plan(const Planned& event);
  void predict_pair(const Histories<D>& paths, Id i, Id j, const Image<D>& image);
  void predict_walls(const Histories<D>& paths, Id i);
  void predict_all(const Histories<D>& paths, Id i);
  void predict_first(const Histories<D>& paths);
  bool stale(const Planned& event) const;
  void open(Histories<D>& paths, NodeRule<D>& rule, Id i, const EventKey<D>& key);
  double approach(const Histories<D>& paths, const EventKey<D>& key, Vec<D>& normal) const;
  void collide(Histories<D>& paths, const EventKey<D>& key);
  std::uint32_t generation(const Histories<D>& paths, Id i, double t) const;
  double reach(const Histories<D>& paths, Id i) const;

  const Box<D>& box_;
  const Particles<D>& particles_;
  ContactScan<D>& scan_;
  std::uint64_t max_events_;
  std::span<const NeighbourPair<D>> pairs_;
  Partners partners_;
  double margin_ = 0;
  std::vector<double> reach_;
  std::vector<std::uint32_t> version_, generation_;
  std::vector<char> held_;
  std::vector<Planned> queue_;
  std::vector<Contact<D>> contacts_;
};

}  // namespace carom
