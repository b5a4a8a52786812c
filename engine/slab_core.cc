#include "engine/slab_core.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "engine/collision.h"
#include "engine/prefetch.h"

namespace carom {

template <int D>
SlabCore<D>::SlabCore(const System<D>& system, ContactScan<D>& scan, std::uint64_t max_events)
    : box_(system.box), particles_(system.particles), scan_(scan), max_events_(max_events), walls_(false) {
  for (int axis = 0; axis < D; ++axis) walls_ = walls_ || box_.walled(axis);
}

template <int D>
void SlabCore<D>::begin(Positions<D> x, double margin) {
  margin_ = margin;
  pairs_ = scan_.candidates(x, margin);
  near_known_ = false;
}

template <int D>
SlabRun<D> SlabCore<D>::run(Histories<D>& paths, NodeRule<D>& rule, std::span<const ExtraNode> extra) {
  using End = typename SlabRun<D>::End;
  const std::size_t n = paths.particles();
  version_.resize(n);
  held_.assign(scan_.resting().empty() ? 0 : n, 0);
  for (const auto& contact : scan_.resting()) {
    held_[contact.key.lo] = 1;
    if (contact.key.kind == EventKind::pair) held_[contact.key.hi] = 1;
  }
  repairs_ = false;
  queue_.clear();
  serving_ = false;
  contacts_.clear();
  met_.clear();
  paths.forget();
  paths.cut_all();
  double farthest = 0;
  if (!near_known_) reach_.resize(n);
  beyond_.clear();
  for (Id i = 0; i < n; ++i) {
    const double far = reach(paths, i);
    farthest = std::max(farthest, far);
    if (!near_known_)
      reach_[i] = kRoom * far;
    else if (far > reach_[i])
      beyond_.push_back(i);
    if (paths.past[i] == Histories<D>::kNone) paths.close_simple(i);
  }
  if (!(farthest <= margin_)) return {.end = End::strayed, .margin = farthest};
  predict_first(paths);
  for (const ExtraNode& node : extra) plan({extra_node_key<D>(node)});
  const SlabRun<D> done = serve(paths, rule, extra);
  if (done.end == End::complete) {
    paths.sort_noded();
    for (const Id i : paths.had_nodes()) paths.close(i);
    for (const Id i : paths.noded())
      if (paths.past[i] == Histories<D>::kNone) paths.close(i);
  }
  return done;
}

template <int D>
SlabRun<D> SlabCore<D>::repair(Histories<D>& paths, NodeRule<D>& rule, std::span<const ExtraNode> extra,
                               std::span<const Id> seeds) {
  using End = typename SlabRun<D>::End;
  repairs_ = true;
  lost_ = false;
  waking_.resize(paths.particles());
  awake_.clear();
  since_.clear();
  queue_.clear();
  serving_ = false;
  const std::size_t known = contacts_.size();
  paths.forget();
  std::ranges::sort(met_);
  met_before_ = met_.size();
  SlabRun<D> done;
  for (const Id i : seeds)
    if (const double far = reach(paths, i); !(far <= margin_)) return {.end = End::strayed, .margin = far};
  if (wake(paths, rule, seeds, extra, nullptr)) done = serve(paths, rule, extra);
  if (lost_) {
    contacts_.resize(known);
    sleep(paths, true);
    return {.end = End::lost};
  }
  if (done.end == End::complete) {
    std::ranges::fill(paths.changed, 0);
    for (const Id i : awake_) paths.close(i);
    const auto stays = [&](const Contact<D>& contact) {
      const EventKey<D>& key = contact.key;
      return asleep(key.lo) ? key.kind == EventKind::wall || asleep(key.hi) || key < since_[waking_[key.hi] - 1]
                            : key < since_[waking_[key.lo] - 1];
    };
    const auto fresh = contacts_.begin() + static_cast<std::ptrdiff_t>(known);
    const auto kept = std::remove_if(contacts_.begin(), fresh, std::not_fn(stays));
    const auto middle = contacts_.erase(kept, fresh);
    std::inplace_merge(contacts_.begin(), middle, contacts_.end(),
                       [](const auto& a, const auto& b) { return a.key < b.key; });
  }
  sleep(paths, false);
  return done;
}

/// Wakes these and everybody they met: from the slab's start, or, with what they did before it, from the event `now`
/// on. False: the repair is lost.
template <int D>
bool SlabCore<D>::wake(Histories<D>& paths, NodeRule<D>& rule, std::span<const Id> who,
                       std::span<const ExtraNode> extra, const EventKey<D>* now) {
  const std::size_t first = awake_.size();
  const EventKey<D> since = now ? *now : EventKey<D>{.time = -1};
  auto add = [&](Id i) {
    if (waking_[i] != 0) return;
    awake_.push_back(i);
    since_.push_back(since);
    waking_[i] = static_cast<std::uint32_t>(awake_.size());
  };
  for (const Id i : who) add(i);
  const std::span<const std::array<Id, 2>> met(met_.data(), met_before_);
  for (std::size_t k = first; k < awake_.size(); ++k)
    for (auto at = std::ranges::lower_bound(met, std::array<Id, 2>{awake_[k], 0});
         at != met.end() && (*at)[0] == awake_[k]; ++at)
      add((*at)[1]);
  for (std::size_t k = first; k < awake_.size(); ++k) {
    const Id i = awake_[k];
    paths.cut(i);
    std::uint32_t at = i;
    for (std::uint32_t n = paths.past[i]; n != Histories<D>::kNone && paths.opening(n) < since; n = paths.next[n]) {
      if (now && paths.start[n] == now->time) lost_ = true;
      const EventKey<D> key = paths.opening(n);
      const std::uint32_t generation = paths.generation(n);
      const Vec<D> v = paths.v[n], a = paths.a[n];
      paths.append(i, key.time, key, v, a);
      paths.generation(paths.last[i]) = generation;
      at = n;
    }
    rule.woken(i, at);
    ++version_[i];
  }
  for (std::size_t k = first; k < awake_.size(); ++k) predict_all(paths, awake_[k]);
  for (const ExtraNode& node : extra) {
    const EventKey<D> key = extra_node_key<D>(node);
    if (waking_[node.who] > first && since < key) plan({key});
  }
  return !lost_;
}

template <int D>
void SlabCore<D>::sleep(Histories<D>& paths, bool restore) {
  for (const Id i : awake_) {
    waking_[i] = 0;
    if (restore) paths.restore(i);
  }
}

/// The next event, if there is one. What was planned before the service began has been sorted once, so that it is known
/// ahead which particles will be needed; what was planned since stands in the heap.
template <int D>
bool SlabCore<D>::next_event(const Histories<D>& paths, Planned& event) {
  if (served_ < first_.size() && (queue_.empty() || first_[served_].key < queue_.front().key)) {
    event = first_[served_++];
    prefetch_upcoming(paths);
    return true;
  }
  if (queue_.empty()) return false;
  std::pop_heap(queue_.begin(), queue_.end());
  event = queue_.back();
  queue_.pop_back();
  return true;
}

/// Fetches what events to come will need, while others are at work: events come in the order of time, so one has
/// nothing to do in space with the next.
template <int D>
void SlabCore<D>::prefetch_upcoming(const Histories<D>& paths) const {
  const auto state = [&](Id i) {
    prefetch_line(&paths.last[i]);
    prefetch_line(&paths.start[i]);
    prefetch_line(&paths.x[i]);
    prefetch_line(&paths.v[i]);
    prefetch_line(&paths.a[i]);
    prefetch_line(&paths.next[i]);
    prefetch_line(&version_[i]);
    prefetch_line(&particles_.radius[i]);
  };
  const auto at = [&](std::size_t ahead, auto&& visit) {
    if (served_ + ahead >= first_.size()) return;
    const EventKey<D>& key = first_[served_ + ahead].key;
    visit(key.lo);
    if (key.kind == EventKind::pair) visit(key.hi);
  };
  const Partners& partners = scan_.candidate_partners();
  at(6, [&](Id i) { partners.prefetch_place(i); });
  at(4, [&](Id i) {
    partners.prefetch(i);
    prefetch_line(&paths.past[i]);
    prefetch_line(&particles_.mass[i]);
  });
  at(2, [&](Id i) {
    for (const auto& [j, pair] : partners.of(i)) {
      state(j);
      prefetch_line(&pairs_[pair]);
    }
  });
}

/// Serves the queue until it is empty.
template <int D>
SlabRun<D> SlabCore<D>::serve(Histories<D>& paths, NodeRule<D>& rule, std::span<const ExtraNode> extra) {
  using End = typename SlabRun<D>::End;
  EventKey<D> latest{.time = -1};
  first_.swap(queue_);
  queue_.clear();
  std::ranges::sort(first_, {}, &Planned::key);
  served_ = 0;
  serving_ = true;
  for (Planned event; next_event(paths, event);) {
    if (stale(event)) continue;
    const EventKey<D>& key = event.key;
    if (!(key.time > 0)) continue;  // rounding: resolve() has seen to what touches at the start
    const bool pair = key.kind == EventKind::pair, extra_node = is_extra(key);
    if (repairs_) {
      lost_ = lost_ || key < latest;
      latest = key;
      for (const Id who : {key.lo, key.hi})
        if ((who == key.lo || pair) && asleep(who)) wake(paths, rule, {&who, 1}, extra, &key);
      if (lost_) return {};
    }
    if (!held_.empty() && (held_[key.lo] || (pair && held_[key.hi])))
      return {.end = End::cut, .time = key.time, .key = key};
    if (!extra_node) {
      if (approach(paths, key) >= -scan_.resting_speed()) return {.end = End::cut, .time = key.time, .key = key};
      if (contacts_.size() >= max_events_) {
        lost_ = repairs_;  // some of them may be gone
        return {.end = End::crowded, .key = key};
      }
    }
    open(paths, rule, key.lo, key);
    if (pair) open(paths, rule, key.hi, key);
    if (!extra_node) collide(paths, key);
    if (pair) met_.insert(met_.end(), {{key.lo, key.hi}, {key.hi, key.lo}});
    for (const Id who : {key.lo, key.hi}) {
      if (who != key.lo && !pair) continue;
      const std::uint32_t at = paths.last[who];
      const double strays = (paths.x[at] - paths.x[who]).norm() + reach(paths, at);
      if (!(strays <= margin_)) return {.end = End::strayed, .margin = strays};
      paths.generation(at) = extra_node ? 0 : key.generation;
      ++version_[who];
    }
    predict_all(paths, key.lo);
    if (pair) predict_all(paths, key.hi);
  }
  return {};
}

/// How far interval n may lead from where it starts.
template <int D>
double SlabCore<D>::reach(const Histories<D>& paths, std::uint32_t n) const {
  const double rest = paths.length - paths.start[n];
  return rest * (paths.v[n].norm() + 0.5 * rest * paths.a[n].norm());
}

template <int D>
bool SlabCore<D>::stale(const Planned& event) const {
  if (is_extra(event.key)) return false;
  return event.version_lo != version_[event.key.lo] ||
         (event.key.kind == EventKind::pair && event.version_hi != version_[event.key.hi]);
}

template <int D>
void SlabCore<D>::plan(const Planned& event) {
  queue_.push_back(event);
  if (serving_) std::push_heap(queue_.begin(), queue_.end());
}

/// 1 + the generation of a node at the same time, else 0: keeps what happens at one instant in its causal order.
template <int D>
std::uint32_t SlabCore<D>::generation(const Histories<D>& paths, Id i, std::uint32_t n, double t) const {
  return n != i && paths.start[n] == t ? paths.generation(n) + 1 : 0;
}

template <int D>
bool SlabCore<D>::near(const Histories<D>& paths, const NeighbourPair<D>& pair, double path) const {
  const double sigma = scan_.contact_distance(pair.i, pair.j), near = sigma + path + scan_.tolerance(sigma);
  return (paths.x[pair.i] - paths.x[pair.j] + box_.shift(pair.image)).squaredNorm() <= near * near;
}

template <int D>
void SlabCore<D>::predict_first(const Histories<D>& paths) {
  if (!near_known_) {
    near_.clear();
    for (std::uint32_t k = 0; k < pairs_.size(); ++k)
      if (near(paths, pairs_[k], reach_[pairs_[k].i] + reach_[pairs_[k].j])) near_.push_back(k);
    near_known_ = true;
  }
  for (const std::uint32_t k : near_) predict_pair(paths, pairs_[k].i, pairs_[k].j, pairs_[k].image);
  for (const Id i : beyond_)
    for (const auto& [j, pair] : scan_.candidate_partners().of(i))
      predict_pair(paths, std::min(i, j), std::max(i, j), pairs_[pair].image);
  if (walls_)
    for (Id i = 0; i < paths.particles(); ++i) predict_walls(paths, i);
}

template <int D>
void SlabCore<D>::predict_all(const Histories<D>& paths, Id i) {
  for (const auto& [j, pair] : scan_.candidate_partners().of(i))
    predict_pair(paths, std::min(i, j), std::max(i, j), pairs_[pair].image);
  if (walls_) predict_walls(paths, i);
}

/// The next contact of the present flights. With one who sleeps: the first on any of his intervals.
template <int D>
void SlabCore<D>::predict_pair(const Histories<D>& paths, Id i, Id j, const Image<D>& image) {
  const std::uint32_t m = paths.last[i], n = paths.last[j];
  if (asleep(j)) {
    for (std::uint32_t each = j; each != Histories<D>::kNone; each = paths.next[each])
      if (paths.end(each) > paths.start[m] && predict_between(paths, i, j, m, each, image)) return;
  } else if (asleep(i)) {
    for (std::uint32_t each = i; each != Histories<D>::kNone; each = paths.next[each])
      if (paths.end(each) > paths.start[n] && predict_between(paths, i, j, each, n, image)) return;
  } else {
    predict_between(paths, i, j, m, n, image);
  }
}

/// Whether interval m of i and interval n of j meet. The contact is a function of the two flights alone, looked at from
/// the later of their starts; it counts where it comes before the end of a flight that is recorded.
template <int D>
bool SlabCore<D>::predict_between(const Histories<D>& paths, Id i, Id j, std::uint32_t m, std::uint32_t n,
                                  const Image<D>& image) {
  const double t = std::max(paths.start[m], paths.start[n]), sigma = scan_.contact_distance(i, j);
  const Vec<D> d = paths.position_in(m, t) - paths.position_in(n, t) + box_.shift(image);
  const Vec<D> v = paths.velocity_in(m, t) - paths.velocity_in(n, t), a = paths.a[m] - paths.a[n];
  const bool touching = scan_.touches(d, sigma);
  // What several events at one node did one after the other is not recorded.
  if (touching && ((asleep(i) && m != i && paths.start[m] == t) || (asleep(j) && n != j && paths.start[n] == t)))
    lost_ = true;
  const double s = contact_time<D>(d, v, a, sigma, paths.length - t, touching, sigma * scan_.resting_speed());
  if (!(t + s < paths.length)) return false;
  EventKey<D> key{.time = t + s, .kind = EventKind::pair, .lo = i, .hi = j, .image = image};
  key.generation = std::max(generation(paths, i, m, key.time), generation(paths, j, n, key.time));
  for (const std::uint32_t each : {m, n})
    if (paths.next[each] != Histories<D>::kNone && !(key < paths.opening(paths.next[each]))) return false;
  if (!held_.empty() && scan_.rests(key)) return false;
  plan({key, version_[i], version_[j]});
  return true;
}

template <int D>
void SlabCore<D>::predict_walls(const Histories<D>& paths, Id i) {
  const std::uint32_t n = paths.last[i];
  const double t = paths.start[n];
  for (int wall = 0; wall < 2 * D; ++wall) {
    const int axis = wall / 2;
    if (!box_.walled(axis)) continue;
    const double gap = scan_.wall_gap(paths.x[n], i, wall), inward = ContactScan<D>::inward(wall);
    const double s = wall_contact_time(gap, inward * paths.v[n][axis], inward * paths.a[n][axis], paths.length - t,
                                       gap <= scan_.tolerance(particles_.radius[i]), scan_.resting_speed());
    if (!(t + s < paths.length)) continue;
    EventKey<D> key{.time = t + s, .kind = EventKind::wall, .lo = i, .hi = static_cast<Id>(wall)};
    key.generation = generation(paths, i, n, key.time);
    if (!held_.empty() && scan_.rests(key)) continue;
    plan({key, version_[i]});
  }
}

/// The normal speed with which the flights meet, negative where they approach.
template <int D>
double SlabCore<D>::approach(const Histories<D>& paths, const EventKey<D>& key) const {
  const std::uint32_t m = paths.last[key.lo];
  const Vec<D> v = paths.velocity_in(m, key.time);
  if (key.kind == EventKind::wall) {
    const int wall = static_cast<int>(key.hi);
    return ContactScan<D>::inward(wall) * v[wall / 2];
  }
  const std::uint32_t n = paths.last[key.hi];
  const Vec<D> normal = paths.position_in(m, key.time) - paths.position_in(n, key.time) + box_.shift(key.image);
  return normal.dot(v - paths.velocity_in(n, key.time)) / normal.norm();
}

template <int D>
void SlabCore<D>::open(Histories<D>& paths, NodeRule<D>& rule, Id i, const EventKey<D>& key) {
  if (!(key.time > paths.start[paths.last[i]])) return;  // the node that is there already
  Vec<D> v, a;
  rule.node(paths, i, key.time, key, v, a);
  paths.append(i, key.time, key, v, a);
}

/// The elastic impulse, where the velocities of arrival still approach.
template <int D>
void SlabCore<D>::collide(Histories<D>& paths, const EventKey<D>& key) {
  const std::uint32_t m = paths.last[key.lo];
  const double mass = particles_.mass[key.lo];
  Contact<D> contact{key, paths.x[m], paths.x[m], Vec<D>::Zero()};
  if (key.kind == EventKind::wall) {
    const int axis = static_cast<int>(key.hi / 2), wall = static_cast<int>(key.hi);
    double& v = paths.v[m][axis];
    if (!(ContactScan<D>::inward(wall) * v < 0)) return;
    contact.impulse[axis] = -2 * mass * v;
    contact.x_hi[axis] = wall % 2 == 0 ? 0.0 : box_.edges[axis];
    v = -v;
  } else {
    const std::uint32_t n = paths.last[key.hi];
    const double mass_hi = particles_.mass[key.hi];
    const Vec<D> d = paths.x[m] - paths.x[n] + box_.shift(key.image), v = paths.v[m] - paths.v[n];
    if (!(d.dot(v) < 0)) return;
    const double g = collision_factor<D>(d, v, mass, mass_hi);
    contact.impulse = g * d;
    contact.x_hi = paths.x[n] - box_.shift(key.image);
    contact.virial = (contact.x_lo - contact.x_hi).dot(contact.impulse);
    paths.v[m] += (g / mass) * d;
    paths.v[n] -= (g / mass_hi) * d;
  }
  contacts_.push_back(contact);
}

template class SlabCore<2>;
template class SlabCore<3>;

}  // namespace carom
