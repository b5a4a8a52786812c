// What a sweep of acdda gives: impulses on the paths flown, how they differ from those flown on, and the paths that
// follow.

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "engine/integrators/acdda.h"

namespace carom::integrator {
namespace {

// What may be left of a particle's impulse, as a velocity and relative to the system's. In intervals before an inner
// node it enters the energy to first order, in last ones, whose ends are given with the newest impulses, to second.
constexpr double kInner = 2e-16, kLastAtMost = 1e-12, kRounding = 1e-16;

}  // namespace

/// impulse_[n]: what interval n receives on these paths.
template <int D>
void AsynchronousDiscreteDerivative<D>::evaluate(const System<D>& system) {
  const Stopwatch watch(counters_->seconds.force);
  impulse_.assign(paths_.intervals(), Vec<D>::Zero());
  PairCounts counts;
  for (std::size_t k = 0; k < memories_.size(); ++k) {
    const PairCounts more = system.interactions[k]->add_impulses(paths_, memories_[k], impulse_);
    counts.evaluations += more.evaluations;
    counts.pairs += more.pairs;
  }
  refresh(system, counts, false);
  pairs_ = std::max(pairs_, counts.pairs);  // in the first sweep nothing is remembered
  count(counts.evaluations);
  if (!scan_->resting().empty()) hold(system, paths_);
}

/// The same after a repair: only of those who have changed, and their partners.
template <int D>
void AsynchronousDiscreteDerivative<D>::reevaluate(const System<D>& system) {
  const Stopwatch watch(counters_->seconds.force);
  impulse_.resize(paths_.intervals(), Vec<D>::Zero());
  changed_.clear();
  for (const Id i : core_->awake())
    if (paths_.changed[i]) changed_.push_back(i);
  affected_.assign(core_->awake().begin(), core_->awake().end());  // their intervals may stand in other places
  PairCounts counts;
  for (std::size_t k = 0; k < memories_.size(); ++k)
    counts.evaluations += system.interactions[k]->renew_impulses(paths_, changed_, memories_[k], affected_);
  std::ranges::sort(affected_);
  affected_.erase(std::ranges::unique(affected_).begin(), affected_.end());
  for (const Id i : affected_)
    if (system.particles.owns(i))
      for (std::uint32_t n = i; n != Histories<D>::kNone; n = paths_.next[n]) impulse_[n].setZero();
  for (std::size_t k = 0; k < memories_.size(); ++k)
    for (const Id i : affected_)
      if (system.particles.owns(i)) system.interactions[k]->add_impulses_on(paths_, i, memories_[k], impulse_);
  refresh(system, counts, true);
  count(counts.evaluations);
}

/// Of several ranks: ghosts get the impulses of their owners and are affected where these are new, and everybody
/// gets the counts of all.
template <int D>
void AsynchronousDiscreteDerivative<D>::refresh(const System<D>& system, PairCounts& counts, bool some) {
  if (!system.part) return;
  told_.clear();
  agreed_ = others_.refresh(paths_, impulse_, told_);
  if (some) {
    affected_.insert(affected_.end(), told_.begin(), told_.end());
    std::ranges::sort(affected_);
    affected_.erase(std::ranges::unique(affected_).begin(), affected_.end());
  }
  std::array<std::uint64_t, 2> totals{counts.evaluations, counts.pairs};
  system.part->ranks().sum(totals);
  counts = {totals[0], totals[1]};
}

template <int D>
void AsynchronousDiscreteDerivative<D>::count(std::uint64_t evaluations) {
  if (pairs_ > 0) counters_->force_passes += static_cast<double>(evaluations) / static_cast<double>(pairs_);
  ++counters_->sweeps;
}

/// Adds the reactions λ(d + d') of resting contacts, which do no work because they hold |d'| = |d|. Who rests has no
/// inner nodes.
template <int D>
void AsynchronousDiscreteDerivative<D>::hold(const System<D>& system, const Histories<D>& paths) {
  const auto& mass = system.particles.mass;
  mean_.resize(paths.particles());
  for (Id i = 0; i < mean_.size(); ++i) mean_[i] = paths.v[i] + impulse_[i] / (2 * mass[i]);
  for (auto& contact : scan_->resting()) {
    const Id lo = contact.key.lo, hi = contact.key.hi;
    if (contact.key.kind == EventKind::pair)
      contact.normal = 2 * (paths.x[lo] - paths.x[hi] + system.box.shift(contact.key.image)) +
                       paths.length * (paths.chord[lo] - paths.chord[hi]);
    contact.lambda = contact.bound = 0;
  }
  press_apart<D>(scan_->resting(), mass, mean_);
  for (const auto& contact : scan_->resting()) {
    const Id lo = contact.key.lo, hi = contact.key.hi;
    impulse_[lo] = 2 * mass[lo] * (mean_[lo] - paths.v[lo]);
    if (contact.key.kind == EventKind::pair) impulse_[hi] = 2 * mass[hi] * (mean_[hi] - paths.v[hi]);
  }
}

/// Accelerates the sweeps, in terms of the velocities that impulses give, as long as everybody meets the same.
template <int D>
void AsynchronousDiscreteDerivative<D>::mix(const Particles<D>& p, bool alike) {
  if (!alike) mixing_.clear();
  Eigen::Index size = 0, at = 0;
  for (Id i = 0; i < paths_.particles(); ++i)
    for (std::uint32_t n = i; n != Histories<D>::kNone; n = paths_.next[n]) size += D;
  Eigen::VectorXd flown(size), lacking(size);
  for (Id i = 0; i < paths_.particles(); ++i)
    for (std::uint32_t n = i; n != Histories<D>::kNone; n = paths_.next[n], at += D) {
      flown.segment<D>(at) = paths_.duration(n) * paths_.a[n];
      lacking.segment<D>(at) = impulse_[n] / p.mass[i] - paths_.duration(n) * paths_.a[n];
    }
  mixing_.add(flown, lacking);
}

template <int D>
double AsynchronousDiscreteDerivative<D>::difference(const Particles<D>& p, Id i, std::uint32_t n) const {
  return (impulse_[n] / p.mass[i] - paths_.duration(n) * paths_.a[n]).norm();
}

/// Compares the impulses with those flown on, and replaces the accelerations of paths by the new ones where there is
/// a difference that matters: who has settled keeps his path bit for bit. Who has not is left in unsettled_.
template <int D>
typename AsynchronousDiscreteDerivative<D>::Change AsynchronousDiscreteDerivative<D>::compare_all(const Particles<D>& p,
                                                                                                  double last_change,
                                                                                                  bool mixes) {
  Change change;
  const auto particles = static_cast<Id>(paths_.particles());
  double squared_speed = 0;
  differences_.resize(particles);
  for (Id i = 0; i < particles; ++i) {
    differences_[i] = difference(p, i, i);
    if (!others_.counts(i)) continue;
    squared_speed =
        std::max({squared_speed, paths_.v[i].squaredNorm(), impulse_[i].squaredNorm() / (p.mass[i] * p.mass[i])});
    change.note(differences_[i]);
  }
  for (const Id i : paths_.noded())
    for (std::uint32_t n = paths_.next[i]; n != Histories<D>::kNone && others_.counts(i); n = paths_.next[n])
      change.note(difference(p, i, n));
  std::array<double, 2> all{squared_speed, change.largest};
  others_.largest(all);
  std::tie(squared_speed, change.largest) = std::tie(all[0], all[1]);
  speed_ = std::sqrt(squared_speed);
  // What the newest impulses still lack is the change times the contraction, this change over the last. It is known
  // best while nobody has settled.
  if (last_change > 0)
    tolerance_ = std::max(tolerance_, std::min(kRounding * last_change / change.largest, kLastAtMost));
  unsettled_.clear();
  Eigen::Index at = 0;
  for (Id i = 0; i < particles; ++i) settle(p, i, differences_[i], mixes ? &at : nullptr, change);
  change.speed = speed_;
  agree_on(change);
  return change;
}

/// Makes a change that of all ranks.
template <int D>
void AsynchronousDiscreteDerivative<D>::agree_on(Change& change) {
  if (others_) {
    std::array<double, 5> most{change.largest, change.unsettled, change.smooth, change.settled ? 0.0 : 1.0,
                               agreed_ ? 0.0 : 1.0};
    others_.largest(most);
    std::tie(change.largest, change.unsettled, change.smooth) = std::tie(most[0], most[1], most[2]);
    change.settled = most[3] == 0;
    change.lost = most[4] > 0;
    others_.ranks().sum({&change.count, 1});
  }
  few_ = kFew * change.count <= total_;
}

/// The same after a repair.
template <int D>
typename AsynchronousDiscreteDerivative<D>::Change AsynchronousDiscreteDerivative<D>::compare_some(
    const Particles<D>& p) {
  Change change{.speed = speed_};
  unsettled_.clear();
  for (const Id i : affected_) {
    for (std::uint32_t n = i; n != Histories<D>::kNone && others_.counts(i); n = paths_.next[n])
      change.note(difference(p, i, n));
    settle(p, i, difference(p, i, i), nullptr, change);
  }
  agree_on(change);
  return change;
}

/// `first`: the difference of the first interval; `mixed`: where the correction of i by mixing stands, if there is
/// one; moved on to that of the next particle.
template <int D>
void AsynchronousDiscreteDerivative<D>::settle(const Particles<D>& p, Id i, double first, Eigen::Index* mixed,
                                               Change& change) {
  const double last = tolerance_ * speed_, inner = std::max(kInner, accepted_) * speed_;
  bool settled = true;
  for (std::uint32_t n = i; n != Histories<D>::kNone; n = paths_.next[n]) {
    const double d = n == i ? first : difference(p, i, n);
    if (!(d <= (paths_.next[n] == Histories<D>::kNone ? last : inner))) {
      const double time = paths_.duration(n);
      if (others_.counts(i)) {
        change.unsettled = std::max(change.unsettled, d);
        if (paths_.simple(i)) change.smooth = std::max(change.smooth, d);
      }
      paths_.a[n] = impulse_[n] / (p.mass[i] * time);
      if (mixed) paths_.a[n] += mixing_.correction().template segment<D>(*mixed) / time;
      settled = false;
    }
    if (mixed) *mixed += D;
  }
  if (settled) return;
  unsettled_.push_back(i);
  if (!others_.counts(i)) return;
  ++change.count;
  change.settled = false;
}

/// Gives everybody whose partners differ from sweep to sweep a node where they first do; whether there was anyone.
template <int D>
bool AsynchronousDiscreteDerivative<D>::separate(bool repaired) {
  bool parted = false;
  constexpr auto kNone = Histories<D>::kNone;
  auto part = [&](Id i) {
    std::uint32_t m = paths_.next[i], n = paths_.past[i];
    while (m != kNone && n != kNone && same_partners(paths_.opening(m), paths_.opening(n))) {
      m = paths_.next[m];
      n = paths_.next[n];
    }
    if (m == kNone && n == kNone) return;
    const double time = std::min(m == kNone ? kNever : paths_.start[m], n == kNone ? kNever : paths_.start[n]);
    extra_.push_back({i, time});
    parted = parted || others_.counts(i);
  };
  if (repaired) {
    for (const Id i : core_->awake()) part(i);
  } else {
    for (const Id i : paths_.had_nodes()) part(i);
    for (const Id i : paths_.noded())
      if (paths_.past[i] == kNone) part(i);
  }
  return others_.any(parted);
}

/// Gives colliders whose impulses change slowly a node a little before their first collision, so that the force on
/// the way to it hardly depends on when it comes; whether there was anyone. (A grazing contact moves much with the
/// force.) Paths have their new accelerations already: where these differ, the chord tells.
template <int D>
bool AsynchronousDiscreteDerivative<D>::steady(const Particles<D>& p, const Change& change) {
  constexpr double kBefore = 0.1;  // in parts of the way
  bool steadied = false;
  for (const Id i : paths_.noded()) {
    if (paths_.simple(i)) continue;
    double moved = 0;
    std::uint32_t first = Histories<D>::kNone;
    for (std::uint32_t n = i; n != Histories<D>::kNone; n = paths_.next[n]) {
      moved = std::max(moved, (impulse_[n] / p.mass[i] - 2 * (paths_.chord[n] - paths_.v[n])).norm());
      const std::uint32_t next = paths_.next[n];
      if (first == Histories<D>::kNone && next != Histories<D>::kNone && !is_extra(paths_.opening(next))) first = n;
    }
    if (first == Histories<D>::kNone || !(moved > 0.1 * change.unsettled)) continue;
    extra_.push_back({i, paths_.end(first) - kBefore * paths_.duration(first)});
    steadied = steadied || others_.counts(i);
  }
  return others_.any(steadied);
}

template void AsynchronousDiscreteDerivative<2>::evaluate(const System<2>&);
template void AsynchronousDiscreteDerivative<2>::reevaluate(const System<2>&);
template void AsynchronousDiscreteDerivative<2>::mix(const Particles<2>&, bool);
template typename AsynchronousDiscreteDerivative<2>::Change AsynchronousDiscreteDerivative<2>::compare_all(
    const Particles<2>&, double, bool);
template typename AsynchronousDiscreteDerivative<2>::Change AsynchronousDiscreteDerivative<2>::compare_some(
    const Particles<2>&);
template bool AsynchronousDiscreteDerivative<2>::separate(bool);
template bool AsynchronousDiscreteDerivative<2>::steady(const Particles<2>&,
                                                        const typename AsynchronousDiscreteDerivative<2>::Change&);
template void AsynchronousDiscreteDerivative<3>::evaluate(const System<3>&);
template void AsynchronousDiscreteDerivative<3>::reevaluate(const System<3>&);
template void AsynchronousDiscreteDerivative<3>::mix(const Particles<3>&, bool);
template typename AsynchronousDiscreteDerivative<3>::Change AsynchronousDiscreteDerivative<3>::compare_all(
    const Particles<3>&, double, bool);
template typename AsynchronousDiscreteDerivative<3>::Change AsynchronousDiscreteDerivative<3>::compare_some(
    const Particles<3>&);
template bool AsynchronousDiscreteDerivative<3>::separate(bool);
template bool AsynchronousDiscreteDerivative<3>::steady(const Particles<3>&,
                                                        const typename AsynchronousDiscreteDerivative<3>::Change&);

}  // namespace carom::integrator
