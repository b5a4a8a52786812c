// What a window has brought, once all regions agree about it.

#include <algorithm>

#include "engine/domains.h"

namespace carom {

/// What own spheres did in this window; each collision counts where its lower id is at home.
template <int D>
typename Domains<D>::Harvest Domains<D>::harvest(double end, std::vector<Contact<D>>* contacts) const {
  Harvest got;
  for (const Local& local : local_)
    for (const Slot i : local.region->touched()) {
      if (!local.region->owns(i)) continue;
      const auto path = local.region->path(i);
      double speed = 0;
      for (const Node<D>& node : path) speed = std::max(speed, node.after.v.norm());
      if (speed + g_.norm() * horizon_ > fastest_) got.astray = std::min(got.astray, astray_at(*local.region, i, end));
      got.speed = std::max(got.speed, speed);
      for (std::size_t k = 0; k < path.size(); ++k) {
        const Node<D>& node = path[k];
        if (node.key.lo != node.after.id) continue;
        const bool pair = node.key.kind == EventKind::pair;
        ++(pair ? got.collisions : got.bounces);
        if (pair) got.virial.add(node.virial);
        got.overlap = std::max(got.overlap, node.overlap);
        if (contacts) contacts->push_back(contact_of(*local.region, i, k));
      }
    }
  return got;
}

/// When a sphere may have come farther than the stray in the window, by the length of its path; infinite: never.
template <int D>
double Domains<D>::astray_at(const Region<D>& region, Slot i, double end) const {
  const auto path = region.path(i);
  double now = now_, left = stray_;
  for (std::size_t k = 0; k <= path.size(); ++k) {
    const double speed = region.before(i, k).v.norm() + g_.norm() * horizon_;
    const double until = k < path.size() ? path[k].key.time : end;
    if (speed * (until - now) > left) return now + left / speed;
    left -= speed * (until - now);
    now = until;
  }
  return std::numeric_limits<double>::infinity();
}

/// The contact that node k of a path stands for.
template <int D>
Contact<D> Domains<D>::contact_of(const Region<D>& region, Slot lo, std::size_t k) const {
  const EventKey<D>& key = region.path(lo)[k].key;
  const Flights<D>& flights = region.flights();
  Record<D> a = region.before(lo, k);
  if (key.kind == EventKind::wall) {
    const int axis = static_cast<int>(key.hi / 2), side = static_cast<int>(key.hi % 2);
    const Blow<D> blow = flights.bounce(lo, a, axis, side, key.time, key.generation);
    return flights.contact_of(key, a, blow);
  }
  const Slot hi = region.slot_of(key.hi);
  const auto path = region.path(hi);
  const auto met = std::ranges::find(path, key, &Node<D>::key) - path.begin();
  Record<D> b = region.before(hi, static_cast<std::size_t>(met));
  const Vec<D> shift = box_.shift(key.image);
  const Blow<D> blow = flights.collide(lo, a, hi, b, shift, key.time, key.generation);
  return flights.contact_of(key, a, b, shift, blow);
}

/// The key of the n-th pair collision of the window.
template <int D>
std::optional<EventKey<D>> Domains<D>::key_of_collision(std::uint64_t number) const {
  Bytes mine;
  for (const Local& local : local_)
    for (const Slot i : local.region->touched()) {
      if (!local.region->owns(i)) continue;
      for (const Node<D>& node : local.region->path(i))
        if (node.key.kind == EventKind::pair && node.key.lo == node.after.id) put(mine, node.key);
    }
  std::vector<EventKey<D>> keys;
  for (const Bytes& bytes : exchange_.gather(mine))
    for (Reader reader(bytes); reader.more();) keys.push_back(reader.get<EventKey<D>>());
  if (number == 0 || number > keys.size()) return std::nullopt;
  std::nth_element(keys.begin(), keys.begin() + static_cast<std::ptrdiff_t>(number - 1), keys.end());
  return keys[number - 1];
}

template typename Domains<2>::Harvest Domains<2>::harvest(double, std::vector<Contact<2>>*) const;
template std::optional<EventKey<2>> Domains<2>::key_of_collision(std::uint64_t) const;
template typename Domains<3>::Harvest Domains<3>::harvest(double, std::vector<Contact<3>>*) const;
template std::optional<EventKey<3>> Domains<3>::key_of_collision(std::uint64_t) const;

}  // namespace carom
