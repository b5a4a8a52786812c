#include "engine/slab_core.h"

#include <algorithm>
#include <cmath>

#include "engine/collision.h"

namespace carom {

template <int D>
void SlabCore<D>::begin(Positions<D> x, double margin) {
  margin_ = margin;
  pairs_ = scan_.candidates(x, margin);
  partners_.clear();
}

template <int D>
const Partners& SlabCore<D>::partners() {
  if (partners_.empty())
    partners_.build(particles_.size(), pairs_.size(), [&](std::size_t k) {
      return std::array<Id, 2>{pairs_[k].i, pairs_[k].j};
    });
  return partners_;
}

template <int D>
SlabRun<D> SlabCore<D>::run(Histories<D>& paths, NodeRule<D>& rule, std::span<const ExtraNode> extra) {
  using End = typename SlabRun<D>::End;
  const std::size_t n = paths.particles();
  version_.assign(n, 0);
  generation_.assign(n, 0);
  held_.assign(scan_.resting().empty() ? 0 : n, 0);
  for (const auto& contact : scan_.resting()) {
    held_[contact.key.lo] = 1;
    if (contact.key.kind == EventKind::pair) held_[contact.key.hi] = 1;
  }
  queue_.clear();
  contacts_.clear();
  reach_.resize(n);
  double farthest = 0;
  for (Id i = 0; i < n; ++i) farthest = std::max(farthest, reach_[i] = reach(paths, i));
  if (farthest > margin_) return {.end = End::strayed, .margin = farthest};
  predict_first(paths);
  for (const ExtraNode& node : extra) plan({extra_node_key<D>(node), 0, 0, true});
  while (!queue_.empty()) {
    std::pop_heap(queue_.begin(), queue_.end());
    const Planned event = queue_.back();
    queue_.pop_back();
    if (stale(event)) continue;
    const EventKey<D>& key = event.key;
    const bool pair = key.kind == EventKind::pair;
    if (!held_.empty() && key.time > 0 && (held_[key.lo] || (pair && held_[key.hi])))
      return {.end = End::cut, .time = key.time, .key = key};
    if (!event.extra) {
      Vec<D> normal;
      if (approach(paths, key, normal) >= -scan_.resting_speed()) {
        if (key.time > 0) return {.end = End::cut, .time = key.time, .key = key};
        continue;  // rounding: resolve() saw it otherwise
      }
      if (contacts_.size() >= max_events_) return {.end = End::crowded, .key = key};
    }
    open(paths, rule, key.lo, key);
    if (pair) open(paths, rule, key.hi, key);
    if (!event.extra) collide(paths, key);
    for (const Id who : {key.lo, key.hi}) {
      if (who != key.lo && !pair) continue;
      const std::uint32_t at = paths.last[who];
      const double strays = (paths.x[at] - paths.x[who]).norm() + reach(paths, who);
      if (strays > margin_) return {.end = End::strayed, .margin = strays};
      generation_[who] = event.extra ? 0 : key.generation;
      ++version_[who];
    }
    predict_all(paths, key.lo);
    if (pair) predict_all(paths, key.hi);
  }
  return {};
}

/// How far particle i may get on its last flight.
template <int D>
double SlabCore<D>::reach(const Histories<D>& paths, Id i) const {
  const std::uint32_t n = paths.last[i];
  const double rest = paths.length - paths.start[n];
  return rest * (paths.v[n].norm() + 0.5 * rest * paths.a[n].norm());
}

template <int D>
bool SlabCore<D>::stale(const Planned& event) const {
  if (event.extra) return false;
  return event.version_lo != version_[event.key.lo] ||
         (event.key.kind == EventKind::pair && event.version_hi != version_[event.key.hi]);
}

template <int D>
void SlabCore<D>::plan(const Planned& event) {
  queue_.push_back(event);
  std::push_heap(queue_.begin(), queue_.end());
}

/// 1 + the generation of a node at the same time, else 0: keeps what happens at one instant in its causal order.
template <int D>
std::uint32_t SlabCore<D>::generation(const Histories<D>& paths, Id i, double t) const {
  return version_[i] > 0 && paths.start[paths.last[i]] == t ? generation_[i] + 1 : 0;
}

template <int D>
void SlabCore<D>::predict_first(const Histories<D>& paths) {
  for (const auto& [i, j, image] : pairs_) {
    const double sigma = scan_.contact_distance(i, j), path = reach_[i] + reach_[j];
    const double near = sigma + path + scan_.tolerance(sigma);
    if ((paths.x[i] - paths.x[j] + box_.shift(image)).squaredNorm() <= near * near) predict_pair(paths, i, j, image);
  }
  for (Id i = 0; i < paths.particles(); ++i) predict_walls(paths, i);
}

template <int D>
void SlabCore<D>::predict_all(const Histories<D>& paths, Id i) {
  for (const auto& [j, pair] : partners().of(i))
    predict_pair(paths, std::min(i, j), std::max(i, j), pairs_[pair].image);
  predict_walls(paths, i);
}

/// The contact is a function of the two flights alone, looked at from the later of their starts.
template <int D>
void SlabCore<D>::predict_pair(const Histories<D>& paths, Id i, Id j, const Image<D>& image) {
  const std::uint32_t m = paths.last[i], n = paths.last[j];
  const double t = std::max(paths.start[m], paths.start[n]), sigma = scan_.contact_distance(i, j);
  const Vec<D> d = paths.position_in(m, t) - paths.position_in(n, t) + box_.shift(image);
  const Vec<D> v = paths.velocity_in(m, t) - paths.velocity_in(n, t), a = paths.a[m] - paths.a[n];
  const double touching_reach = sigma + scan_.tolerance(sigma);
  const bool touching = d.squaredNorm() <= touching_reach * touching_reach;
  const double s = contact_time<D>(d, v, a, sigma, paths.length - t, touching, sigma * scan_.resting_speed());
  if (!(t + s < paths.length)) return;
  EventKey<D> key{.time = t + s, .kind = EventKind::pair, .lo = i, .hi = j, .image = image};
  key.generation = std::max(generation(paths, i, key.time), generation(paths, j, key.time));
  if (!held_.empty() && scan_.rests(key)) return;
  plan({key, version_[i], version_[j], false});
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
    key.generation = generation(paths, i, key.time);
    if (!held_.empty() && scan_.rests(key)) continue;
    plan({key, version_[i], 0, false});
  }
}

/// The normal speed with which the flights meet, negative where they approach; and the normal.
template <int D>
double SlabCore<D>::approach(const Histories<D>& paths, const EventKey<D>& key, Vec<D>& normal) const {
  const std::uint32_t m = paths.last[key.lo];
  const Vec<D> v = paths.velocity_in(m, key.time);
  if (key.kind == EventKind::wall) {
    const int axis = static_cast<int>(key.hi / 2);
    normal = ContactScan<D>::inward(static_cast<int>(key.hi)) * Vec<D>::Unit(axis);
    return normal.dot(v);
  }
  const std::uint32_t n = paths.last[key.hi];
  normal = paths.position_in(m, key.time) - paths.position_in(n, key.time) + box_.shift(key.image);
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
    paths.v[m] += (g / mass) * d;
    paths.v[n] -= (g / mass_hi) * d;
  }
  contacts_.push_back(contact);
}

template class SlabCore<2>;
template class SlabCore<3>;

}  // namespace carom
