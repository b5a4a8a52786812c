#pragma once
// What every particle did within one slab: its intervals between nodes of its own.
//
// All particles meet at both ends of a slab and nowhere else. Inside it each has nodes of its own, its collisions, and
// flies from node to node on x + s v + s² a/2. Intervals stand in common arrays: number i < N is the first one of
// particle i, further ones are appended as they come and linked. Emptying the arrays for the next slab keeps their
// memory, so that a node costs no allocation.
//
// Two particles share no mesh, so a pair is looked at over its stretches, the pieces between the union of both
// partners' nodes:
//
//   histories.for_each_stretch(i, j, [&](std::uint32_t m, std::uint32_t n, double from, double to) { … });
//
// m and n are the intervals of i and j that the stretch [from, to] belongs to.

#include <algorithm>
#include <span>
#include <vector>

#include "engine/contact_log.h"

namespace carom {

template <int D>
struct Histories {
  static constexpr std::uint32_t kNone = 0xffffffff;

  double length = 0;                 ///< of the slab
  std::vector<double> start;         ///< of an interval, since the slab's start; > 0 but for the first ones
  std::vector<Vec<D>> x, v, a;       ///< position and velocity at its start, acceleration of its flight
  std::vector<Vec<D>> chord;         ///< mean velocity over it; set by close()
  std::vector<std::uint32_t> next;   ///< the particle's next interval, or kNone
  std::vector<EventKey<D>> opening;  ///< the event that opened it; of no meaning for first intervals
  std::vector<std::uint32_t> last;   ///< by particle: its last interval

  std::size_t particles() const { return last.size(); }
  std::size_t intervals() const { return start.size(); }

  /// One interval a particle, from x and v with accelerations a.
  void reset(double slab_length, std::span<const Vec<D>> x0, std::span<const Vec<D>> v0, std::span<const Vec<D>> a0) {
    const std::size_t n = x0.size();
    length = slab_length;
    start.assign(n, 0.0);
    next.assign(n, kNone);
    opening.resize(n);
    x.assign(x0.begin(), x0.end());
    v.assign(v0.begin(), v0.end());
    a.assign(a0.begin(), a0.end());
    last.resize(n);
    for (std::uint32_t i = 0; i < n; ++i) last[i] = i;
  }

  /// Ends the last interval of particle i at time t with a node, from where it goes on with v and a.
  void append(Id i, double t, const EventKey<D>& key, const Vec<D>& v_after, const Vec<D>& a_after) {
    const Vec<D> at = position_in(last[i], t);
    const auto fresh = static_cast<std::uint32_t>(intervals());
    next[last[i]] = fresh;
    last[i] = fresh;
    start.push_back(t);
    x.push_back(at);
    v.push_back(v_after);
    a.push_back(a_after);
    next.push_back(kNone);
    opening.push_back(key);
  }

  /// Computes the chords, once all nodes are there.
  void close() {
    chord.resize(intervals());
    for (std::uint32_t n = 0; n < intervals(); ++n) chord[n] = v[n] + (0.5 * duration(n)) * a[n];
  }

  /// Whether particle i has no inner node.
  bool simple(Id i) const { return next[i] == kNone; }
  double end(std::uint32_t n) const { return next[n] == kNone ? length : start[next[n]]; }
  double duration(std::uint32_t n) const { return end(n) - start[n]; }
  /// The interval of particle i that time t belongs to; at a node the one that starts there.
  std::uint32_t at(Id i, double t) const {
    std::uint32_t n = i;
    while (next[n] != kNone && start[next[n]] <= t) n = next[n];
    return n;
  }
  Vec<D> position_in(std::uint32_t n, double t) const {
    const double s = t - start[n];
    return x[n] + s * v[n] + (0.5 * s * s) * a[n];
  }
  Vec<D> velocity_in(std::uint32_t n, double t) const { return v[n] + (t - start[n]) * a[n]; }

  /// The stretches of a pair, in their order.
  template <class Visit>
  void for_each_stretch(Id i, Id j, Visit&& visit) const {
    std::uint32_t m = i, n = j;
    for (double from = 0;;) {
      const double end_m = end(m), end_n = end(n), to = std::min(end_m, end_n);
      visit(m, n, from, to);
      if (next[m] == kNone && next[n] == kNone) return;
      if (end_m == to) m = next[m];
      if (end_n == to) n = next[n];
      from = to;
    }
  }
};

}  // namespace carom
