#pragma once
// How acdda flies from sweep to sweep, and who has met the same as before.

#include <numeric>
#include <vector>

#include "engine/slab_core.h"

namespace carom::integrator {

/// Whether particle i has the same partners as in the sweep before, met in the same order.
template <int D>
bool same_meetings(const Histories<D>& paths, Id i) {
  std::uint32_t m = paths.next[i], n = paths.past[i];
  for (; m != Histories<D>::kNone && n != Histories<D>::kNone; m = paths.next[m], n = paths.next[n])
    if (!same_partners(paths.opening(m), paths.opening(n))) return false;
  return m == n;
}

/// Flights of a sweep: on the mean forces of the same interval in the sweep before.
template <int D>
class SweepRule : public NodeRule<D> {
 public:
  /// Before everybody is run. `first`: there was no sweep before.
  void follow(bool first, std::size_t particles) {
    first_ = first;
    interval_.resize(particles);
    std::iota(interval_.begin(), interval_.end(), 0);
  }
  void woken(Id i, std::uint32_t past) override {
    first_ = false;
    interval_[i] = past;
  }
  void node(const Histories<D>& paths, Id i, double t, const EventKey<D>& key, Vec<D>& v, Vec<D>& a) override {
    const std::uint32_t m = paths.last[i];
    v = paths.velocity_in(m, t);
    a = paths.a[m];
    if (first_) return;
    const std::uint32_t expected = interval_[i] == i ? paths.past[i] : paths.next[interval_[i]];
    const bool same = expected != Histories<D>::kNone && same_partners(paths.opening(expected), key);
    interval_[i] = same ? expected : paths.past_at(i, t);
    a = paths.a[interval_[i]];
  }

 private:
  bool first_ = true;
  std::vector<std::uint32_t> interval_;  // of the sweep before, where each particle is
};

}  // namespace carom::integrator
