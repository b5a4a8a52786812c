#pragma once
// What every particle did within one slab: its intervals between nodes of its own.
//
// All particles meet at both ends of a slab and nowhere else. Inside it each has nodes of its own, its collisions, and
// flies from node to node on x + s v + s² a/2. Intervals stand in common arrays: number i < N is the first one of
// particle i, the others take places behind them as they come and are linked; a place that is given back is used again.
//
// Slabs are run again and again with other accelerations. cut() takes a particle back to its first interval; what it
// did behind it stays readable, from past[i] on, until forget().
//
// Two particles share no mesh, so a pair is looked at over its stretches, the pieces between the union of both
// partners' nodes:
//
//   histories.for_each_stretch(i, j, [&](std::uint32_t m, std::uint32_t n, double from, double to) { … });
//
// m and n are the intervals of i and j that the stretch [from, to] belongs to.

#include <algorithm>
#include <limits>
#include <span>
#include <vector>

#include "engine/contact_log.h"

namespace carom {

template <int D>
struct Histories {
  static constexpr std::uint32_t kNone = 0xffffffff;

  double length = 0;                ///< of the slab
  std::vector<double> start;        ///< of an interval, since the slab's start; > 0 but for the first ones
  std::vector<Vec<D>> x, v, a;      ///< position and velocity at its start, acceleration of its flight
  std::vector<Vec<D>> chord;        ///< mean velocity over it
  std::vector<std::uint32_t> next;  ///< the particle's next interval, or kNone
  std::vector<std::uint32_t> last;  ///< by particle: its last interval
  std::vector<std::uint32_t> past;  ///< by particle: the interval after its first one before it was cut, or kNone
  std::vector<char> changed;        ///< by particle: whether chords or nodes differ in any bit from the run before

  std::size_t particles() const { return last.size(); }
  /// Places for intervals, those in no use among them.
  std::size_t intervals() const { return start.size(); }
  /// Who has inner nodes, and who had some before it was cut; in no order but after sort_noded().
  std::span<const Id> noded() const { return noded_; }
  std::span<const Id> had_nodes() const { return cut_; }

  /// One interval a particle, from x and v; accelerations are to be given.
  void reset(double slab_length, std::span<const Vec<D>> x0, std::span<const Vec<D>> v0) {
    const std::size_t n = x0.size();
    length = slab_length;
    start.assign(n, 0.0);
    next.assign(n, kNone);
    past.assign(n, kNone);
    changed.assign(n, 1);
    x.assign(x0.begin(), x0.end());
    v.assign(v0.begin(), v0.end());
    a.resize(n);
    chord.assign(n, Vec<D>::Constant(std::numeric_limits<double>::quiet_NaN()));  // differs from anything
    last.resize(n);
    for (std::uint32_t i = 0; i < n; ++i) last[i] = i;
    opening_.clear();
    free_.clear();
    noded_.clear();
    cut_.clear();
  }

  /// Ends the last interval of particle i at time t with a node, from where it goes on with v and a.
  void append(Id i, double t, const EventKey<D>& key, const Vec<D>& v_after, const Vec<D>& a_after) {
    const Vec<D> at = position_in(last[i], t);
    const std::uint32_t fresh = place();
    if (last[i] == i && past[i] == kNone) noded_.push_back(i);
    next[last[i]] = fresh;
    last[i] = fresh;
    start[fresh] = t;
    x[fresh] = at;
    v[fresh] = v_after;
    a[fresh] = a_after;
    next[fresh] = kNone;
    opening_[fresh - particles()] = {key, key.generation};
  }

  /// Takes particle i, whom nobody has cut since forget(), back to its first interval.
  void cut(Id i) {
    if (simple(i)) return;
    cut_.push_back(i);
    past[i] = next[i];
    next[i] = kNone;
    last[i] = i;
  }
  void cut_all() {
    for (const Id i : noded_) cut(i);
  }
  /// Takes particle i back to what it did before it was cut.
  void restore(Id i) {
    release(next[i]);
    next[i] = past[i];
    past[i] = kNone;
    for (last[i] = i; next[last[i]] != kNone;) last[i] = next[last[i]];
  }
  /// Gives back what particles did before they were cut.
  void forget() {
    for (const Id i : cut_) {
      release(past[i]);
      past[i] = kNone;
    }
    cut_.clear();
    std::erase_if(noded_, [&](Id i) { return simple(i); });
  }

  /// Brings those who have inner nodes into the order of their ids: loops over them then go through memory once.
  void sort_noded() {
    const auto fresh = std::ranges::is_sorted_until(noded_);
    std::sort(fresh, noded_.end());
    std::inplace_merge(noded_.begin(), fresh, noded_.end());
  }

  /// Computes the chord of a particle without inner nodes.
  void close_simple(Id i) {
    const Vec<D> fresh = v[i] + (0.5 * length) * a[i];
    changed[i] = fresh != chord[i];
    chord[i] = fresh;
  }
  /// Computes the chords of particle i, after its nodes are there.
  void close(Id i) {
    const Vec<D> before = chord[i];
    for (std::uint32_t n = i; n != kNone; n = next[n]) chord[n] = v[n] + (0.5 * duration(n)) * a[n];
    changed[i] = before != chord[i];
    std::uint32_t m = past[i], n = next[i];
    for (; m != kNone && n != kNone && changed[i] == 0; m = next[m], n = next[n])
      changed[i] = start[m] != start[n] || x[m] != x[n] || chord[m] != chord[n];
    if ((m == kNone) != (n == kNone)) changed[i] = 1;
  }

  /// The event that opened interval n, which is not a first one.
  const EventKey<D>& opening(std::uint32_t n) const { return opening_[n - particles()].key; }
  /// The generation of the last event at the start of interval n, which is not a first one.
  std::uint32_t& generation(std::uint32_t n) { return opening_[n - particles()].generation; }
  std::uint32_t generation(std::uint32_t n) const { return opening_[n - particles()].generation; }

  /// Whether particle i has no inner node.
  bool simple(Id i) const { return next[i] == kNone; }
  double end(std::uint32_t n) const { return next[n] == kNone ? length : start[next[n]]; }
  double duration(std::uint32_t n) const { return end(n) - start[n]; }
  /// The interval of particle i that time t belongs to; at a node the one that starts there.
  std::uint32_t at(Id i, double t) const { return at(i, next[i], t); }
  /// The same before it was cut.
  std::uint32_t past_at(Id i, double t) const { return at(i, past[i], t); }
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

 private:
  struct Opening {
    EventKey<D> key;
    std::uint32_t generation;
  };

  std::uint32_t at(std::uint32_t n, std::uint32_t following, double t) const {
    for (; following != kNone && start[following] <= t; following = next[following]) n = following;
    return n;
  }

  std::uint32_t place() {
    if (free_.empty()) {
      const std::size_t size = intervals(), room = size + particles() / 16 + 16;
      auto extend = [&](auto& each, std::size_t most) {
        if (each.size() == each.capacity()) each.reserve(most);
        each.emplace_back();
      };
      extend(start, room), extend(next, room);
      extend(x, room), extend(v, room), extend(a, room), extend(chord, room);
      extend(opening_, room - particles());
      return static_cast<std::uint32_t>(size);
    }
    const std::uint32_t n = free_.back();
    free_.pop_back();
    return n;
  }
  void release(std::uint32_t n) {
    for (; n != kNone; n = next[n]) free_.push_back(n);
  }

  std::vector<Opening> opening_;
  std::vector<std::uint32_t> free_;
  std::vector<Id> noded_, cut_;
};

}  // namespace carom
