// How a subdomain repairs a window where paths of its ghosts are not those that their owners sent.

#include <algorithm>

#include "engine/ranks/subdomain.h"

namespace carom {

template <int D>
void Subdomain<D>::repair() {
  repairs_.clear();
  for (const Slot g : scripts_.slots()) seed(g);
  for (const Slot i : touched_ghosts_)
    if (!scripts_.has(i)) seed(i);
  for (const Slot i : paths_.slots())
    if (role_[i] == Role::ghost && !scripts_.has(i) && !trace_.has(i)) seed(i);
  while (!tasks_.empty()) {
    const Task task = tasks_.top();
    tasks_.pop();
    switch (task.kind) {
      case Task::Kind::contact:
        contact(task);
        break;
      case Task::Kind::script:
        script(task);
        break;
      case Task::Kind::check:
        check(task);
        break;
      case Task::Kind::seed:
        if (mended(task.a)) break;
        Mended& m = mend(task.a, task.key);
        plan_script(m);
        if (!follows_at_once(m, task.key)) predict(m, task.key);
    }
  }
  changed_.clear();
  for (const Mended& m : repairs_) {
    mended_of_[m.slot] = kNone;
    if (!is_own(m.slot)) continue;
    const auto now = path(m.slot).subspan(m.kept);
    if (!std::equal(now.begin(), now.end(), m.old.begin(), m.old.end())) changed_.push_back(m.slot);
  }
}

/// Where the path of a ghost differs from its script, and not by a contact with own spheres, it is repaired from there.
/// Contacts with own spheres are decided by this subdomain, not by the owner of the ghost.
template <int D>
void Subdomain<D>::seed(Slot g) {
  if (matches(g)) return;
  const auto seen = path(g), script = script_of(g);
  std::size_t k = 0;
  while (k < seen.size() && k < script.size() && seen[k] == script[k]) ++k;
  const bool sees = k < seen.size() && !is_own_id(seen[k].partner());
  if (k < script.size() && (k == seen.size() || script[k].key <= seen[k].key)) {
    if (is_own_id(script[k].partner()) && !sees) return;
    tasks_.push({.kind = Task::Kind::seed, .key = script[k].key, .a = g});
  } else if (sees) {
    tasks_.push({.kind = Task::Kind::seed, .key = seen[k].key, .a = g});
  }
}

/// Cuts the path of a sphere at `key`; the partners of the events taken back must be checked.
template <int D>
typename Subdomain<D>::Mended& Subdomain<D>::mend(Slot i, const EventKey<D>& key) {
  Nodes& path = rewritten(i).nodes;
  const auto from = std::find_if(path.begin(), path.end(), [&](const Node<D>& n) { return !(n.key < key); });
  mended_of_[i] = static_cast<std::uint32_t>(repairs_.size());
  Mended& m = repairs_.emplace_back();
  m.slot = i;
  m.version = 1;
  m.kept = static_cast<std::size_t>(from - path.begin());
  m.old.assign(from, path.end());
  path.erase(from, path.end());
  m.now = before(i, m.kept);
  if (role_[i] == Role::ghost) {
    const auto script = script_of(i);
    m.script = m.kept;
    m.left_script = m.kept > script.size() || !std::equal(path.begin(), path.end(), script.begin());
  }
  for (const Node<D>& node : m.old) {
    const Slot partner = node.key.kind == EventKind::wall ? IdTable::kNowhere : slots_.find(node.partner());
    if (partner != IdTable::kNowhere) tasks_.push({.kind = Task::Kind::check, .key = node.key, .a = i, .b = partner});
  }
  return m;
}

template <int D>
void Subdomain<D>::plan_script(Mended& m) {
  const auto script = script_of(m.slot);
  if (m.left_script || m.script >= script.size()) return;
  tasks_.push({.kind = Task::Kind::script,
               .key = script[m.script].key,
               .a = m.slot,
               .version_a = static_cast<std::uint32_t>(m.script)});
}

/// Where a ghost can meet own spheres, which are within `max_displacement` of the subdomain, and are known where they
/// come within another two: between two corners. False: nowhere.
template <int D>
bool Subdomain<D>::meeting_place(const Mended& m, Vec<D>& low, Vec<D>& high) const {
  const double time = end_ - m.now.t, way = (m.now.v.norm() + 0.5 * time * core_.flights().g().norm()) * time;
  const Vec<D> at = bisection_->wrapped(m.now.x);
  const double close = bisection_->reach() - max_displacement_ + way;
  if (bisection_->squared_distance(number_, at) > close * close) return false;
  const Vec<D> room = Vec<D>::Constant(bisection_->reach() + way);
  low = at - room;
  high = at + room;
  if (!bisection_->clip(number_, 3 * max_displacement_, low, high)) return false;
  low += m.now.x - at;
  high += m.now.x - at;
  return true;
}

/// Whether two spheres can come together at all; the other is known where it comes within twice `max_displacement`.
template <int D>
bool Subdomain<D>::may_meet(const Mended& m, Slot j, const Image<D>& image) const {
  const double time = end_ - m.now.t, way = (m.now.v.norm() + 0.5 * time * core_.flights().g().norm()) * time;
  const double close = bisection_->reach() + way;
  const Record<D>& r = core_.flights()[j];
  const double s = end_ - r.t;
  const Vec<D> d = m.now.x - (r.x + s * r.v + (0.5 * s * s) * core_.flights().g()) + box_.shift(image);
  return d.squaredNorm() <= close * close;
}

/// Whether the next event in the script of a ghost is at this very key.
template <int D>
bool Subdomain<D>::follows_at_once(const Mended& m, const EventKey<D>& key) {
  const auto script = script_of(m.slot);
  return !m.left_script && m.script < script.size() && script[m.script].key == key;
}

/// Plans all contacts that a mended sphere may have from `now` on.
template <int D>
void Subdomain<D>::predict(Mended& m, const EventKey<D>& now) {
  const Packing<D>& packing = core_.packing();
  if (role_[m.slot] == Role::ghost) {
    Vec<D> low, high;
    if (!meeting_place(m, low, high)) return;
    for (const std::uint32_t candidate : core_.find_near_at_border(m.slot, low, high))
      if (const Slot j = packing.slot(candidate); is_own(j) && may_meet(m, j, packing.image(candidate)))
        meet(m, j, packing.image(candidate), now);
  } else {
    for (const std::uint32_t candidate : core_.find_near(m.slot))
      if (const Slot j = packing.slot(candidate); j != m.slot && may_meet(m, j, packing.image(candidate)))
        meet(m, j, packing.image(candidate), now);
  }
  predict_walls(m);
}

template <int D>
void Subdomain<D>::meet(Mended& m, Slot j, const Image<D>& image, const EventKey<D>& now) {
  const Flights<D>& flights = core_.flights();
  const Vec<D> shift = box_.shift(image);
  const auto key_at = [&](const Record<D>& other, double t) {
    const auto generation = std::max(Flights<D>::generation_at(m.now, t), Flights<D>::generation_at(other, t));
    return pair_key<D>(t, generation, m.now.id, other.id, image);
  };
  const auto plan = [&](const EventKey<D>& key) {
    tasks_.push({.kind = Task::Kind::contact,
                 .key = key,
                 .a = m.slot,
                 .b = j,
                 .version_a = m.version,
                 .version_b = version(j),
                 .image = image});
  };
  if (mended(j)) {
    const Record<D>& other = repairs_[mended_of_[j]].now;
    const double t = flights.pair_contact(m.slot, m.now, j, other, shift);
    if (t < end_) plan(key_at(other, t));
    return;
  }
  // Along its path: a contact counts only before the path turns.
  const auto path = has_no_events(j) ? std::span<const Node<D>>() : this->path(j);
  std::size_t k = 0;
  while (k < path.size() && path[k].key < now) ++k;
  for (;; ++k) {
    const Record<D>& other = path.empty() ? after(j) : before(j, k);
    const double t = flights.pair_contact(m.slot, m.now, j, other, shift);
    if (t < end_)
      if (const EventKey<D> key = key_at(other, t); k == path.size() || key <= path[k].key) return plan(key);
    if (k == path.size()) return;
  }
}

template <int D>
void Subdomain<D>::predict_walls(Mended& m) {
  for (const Wall<D>& wall : core_.flights().walls()) {
    const double t = core_.flights().wall_contact(m.slot, m.now, wall);
    if (!(t < end_)) continue;
    tasks_.push({.kind = Task::Kind::contact,
                 .key = {.time = t,
                         .generation = Flights<D>::generation_at(m.now, t),
                         .kind = EventKind::wall,
                         .lo = m.now.id,
                         .hi = wall.number()},
                 .a = m.slot,
                 .version_a = m.version});
  }
}

template <int D>
void Subdomain<D>::contact(const Task& task) {
  const EventKey<D>& key = task.key;
  const bool pair = key.kind == EventKind::pair;
  if (version(task.a) != task.version_a || (pair && version(task.b) != task.version_b)) return;
  ++redone_events_;
  Mended& a = mended(task.a) ? repairs_[mended_of_[task.a]] : mend(task.a, key);
  if (!pair) {
    Node<D> node{a.now, key};
    const Wall<D> wall = box_.wall(key.hi);
    const Blow<D> blow = core_.flights().bounce(a.slot, node.after, wall, key.time, key.generation);
    node.virial = wall.work(blow.impulse);
    node.overlap = blow.overlap;
    append(a, node);
    predict(a, key);
    return;
  }
  Mended& b = mended(task.b) ? repairs_[mended_of_[task.b]] : mend(task.b, key);
  Node<D> of_a{a.now, key}, of_b{b.now, key};
  const Blow<D> blow =
      core_.flights().collide(a.slot, of_a.after, b.slot, of_b.after, box_.shift(task.image), key.time, key.generation);
  of_a.virial = of_b.virial = blow.d.dot(blow.impulse);
  of_a.overlap = of_b.overlap = blow.overlap;
  append(a, of_a);
  append(b, of_b);
  predict(a, key);
  predict(b, key);
}

/// Adds a node to a path. A ghost follows its script as long as the script has the same node.
template <int D>
void Subdomain<D>::append(Mended& m, const Node<D>& node) {
  rewritten(m.slot).nodes.push_back(node);
  m.now = node.after;
  mended_fastest_squared_ = std::max(mended_fastest_squared_, node.after.v.squaredNorm());
  ++m.version;
  if (role_[m.slot] != Role::ghost || m.left_script) return;
  const auto script = script_of(m.slot);
  m.left_script = m.script >= script.size() || !(script[m.script] == node);
  ++m.script;
  plan_script(m);
}

/// A ghost follows its script in an event without own spheres.
template <int D>
void Subdomain<D>::script(const Task& task) {
  Mended& m = repairs_[mended_of_[task.a]];
  if (m.left_script || m.script != task.version_a) return;
  const Node<D>& node = script_of(task.a)[m.script];
  if (is_own_id(node.partner())) {  // here they did not meet, and this subdomain decides that
    m.left_script = true;
    predict(m, task.key);
    return;
  }
  append(m, node);
  predict(m, task.key);
}

/// A sphere that has been mended met this one here, and no longer does.
template <int D>
void Subdomain<D>::check(const Task& task) {
  if (mended(task.b) || (role_[task.a] == Role::ghost && role_[task.b] == Role::ghost)) return;
  Mended& m = mend(task.b, task.key);
  if (role_[task.b] == Role::ghost) m.left_script = true;
  predict(m, task.key);
}

template void Subdomain<2>::repair();
template void Subdomain<3>::repair();

}  // namespace carom
