#include "engine/region.h"

#include <algorithm>

namespace carom {

template <int D>
void Region<D>::load(std::vector<Record<D>> own, const std::vector<Record<D>>& ghosts, const Vec<D>& g, double horizon,
                     double now, double stray) {
  stray_ = stray;
  rewritten_.clear();
  script_.clear();
  slot_.clear();
  role_.clear();
  first_.clear();
  length_.clear();
  start_of_.clear();
  mended_of_.clear();
  for (const Record<D>& r : ghosts) slot_[r.id] = kNone;
  own.insert(own.end(), ghosts.begin(), ghosts.end());
  core_.load(std::move(own), g, horizon, now, 2 * stray);
  const auto n = static_cast<Slot>(core_.flights().size());
  border_.clear();
  ghosts_.clear();
  for (Slot i = 0; i < n; ++i) {
    const Id id = core_.flights()[i].id;
    enlist(i, id, slot_.contains(id) ? Role::ghost : Role::own);
  }
  touched_.clear();
  changed_.clear();
  start_.clear();
}

template <int D>
void Region<D>::enlist(Slot i, Id id, Role role) {
  slot_[id] = i;
  if (role_.size() <= i) role_.resize(i + 1, Role::nobody);
  role_[i] = role;
  (role == Role::own ? border_ : ghosts_).push_back(i);
  first_.resize(role_.size());
  length_.resize(role_.size(), 0);
  start_of_.resize(role_.size(), kNone);
  mended_of_.resize(role_.size(), kNone);
  rewritten_.resize(role_.size());
  script_.resize(role_.size());
}

template <int D>
void Region<D>::forget(Slot i) {
  role_[i] = Role::nobody;
  slot_.erase(core_.flights()[i].id);
  core_.dismiss(i);
}

template <int D>
std::vector<Slot> Region<D>::own() const {
  std::vector<Slot> own;
  for (Slot i = 0; i < role_.size(); ++i)
    if (role_[i] == Role::own) own.push_back(i);
  return own;
}

template <int D>
void Region<D>::watch(double now, const std::function<bool(const Vec<D>&)>& near) {
  border_ = own();
  std::erase_if(border_, [&](Slot i) { return !near(core_.flights().at(i, now).x); });
  core_.set_border(border_, ghosts_, now);
}

template <int D>
bool Region<D>::admit(const Record<D>& r, double now) {
  if (has(r.id)) return true;
  Slot slot = 0;
  if (!core_.admit(r, now, slot)) return false;
  enlist(slot, r.id, Role::ghost);
  return true;
}

template <int D>
void Region<D>::run(double now, double end) {
  end_ = end;
  trace_.clear(now);
  Counters unused;
  core_.run(end, {.counters = unused, .trace = &trace_});
  run_events_ += std::ranges::count_if(trace_.nodes, [](const Node<D>& n) { return n.key.lo == n.after.id; });
  index();
}

/// Sorts the nodes of the first run by sphere.
template <int D>
void Region<D>::index() {
  touched_.clear();
  changed_.clear();
  start_.clear();
  for (const auto& [slot, record] : trace_.starts) {
    start_of_[slot] = static_cast<std::uint32_t>(start_.size());
    start_.push_back(record);
    touched_.push_back(slot);
    if (role_[slot] == Role::own) changed_.push_back(slot);
  }
  for (const Node<D>& node : trace_.nodes) ++length_[node.slot];
  std::uint32_t at = 0;
  for (const Slot i : touched_) {
    first_[i] = at;
    at += length_[i];
    length_[i] = 0;
  }
  nodes_.resize(trace_.nodes.size());
  for (const Node<D>& node : trace_.nodes) nodes_[first_[node.slot] + length_[node.slot]++] = node;
}

template <int D>
std::span<const Node<D>> Region<D>::path(Slot i) const {
  if (rewritten_.has(i)) return rewritten_.at(i);
  return length_[i] == 0 ? std::span<const Node<D>>{} : std::span<const Node<D>>(&nodes_[first_[i]], length_[i]);
}

template <int D>
const Record<D>& Region<D>::before(Slot i, std::size_t k) const {
  if (k > 0) return path(i)[k - 1].after;
  return start_of_[i] == kNone ? core_.flights()[i] : start_[start_of_[i]];
}

template <int D>
const Record<D>& Region<D>::after(Slot i) const {
  return before(i, path(i).size());
}

template <int D>
bool Region<D>::is_own(Id id) const {
  const auto it = slot_.find(id);
  return it != slot_.end() && role_[it->second] == Role::own;
}

template <int D>
std::vector<Node<D>>& Region<D>::rewritten(Slot i) {
  if (rewritten_.has(i)) return rewritten_[i];
  const auto old = path(i);
  if (start_of_[i] == kNone) {  // it had no event until now
    start_of_[i] = static_cast<std::uint32_t>(start_.size());
    start_.push_back(core_.flights()[i]);
    touched_.push_back(i);
  }
  Nodes& path = rewritten_[i];
  path.assign(old.begin(), old.end());
  return path;
}

template <int D>
void Region<D>::follow(Id id, Nodes script) {
  script_[slot_.at(id)] = std::move(script);
}

template <int D>
void Region<D>::repair() {
  repairs_.clear();
  for (const Slot g : script_.who()) seed(g);
  for (const Slot i : touched_)
    if (role_[i] == Role::ghost && !script_.has(i)) seed(i);
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
        predict(m, task.key);
    }
  }
  changed_.clear();
  for (const Mended& m : repairs_) {
    mended_of_[m.slot] = kNone;
    if (role_[m.slot] != Role::own) continue;
    const auto now = path(m.slot).subspan(m.kept);
    if (!std::equal(now.begin(), now.end(), m.old.begin(), m.old.end())) changed_.push_back(m.slot);
  }
}

/// Where what was seen of a ghost differs from its script, and the ghost is to blame, it must be mended from there.
/// What it does with own spheres of this region is not its owner's to know first.
template <int D>
void Region<D>::seed(Slot g) {
  const auto seen = path(g);
  const auto script = script_.at(g);
  std::size_t k = 0;
  while (k < seen.size() && k < script.size() && seen[k] == script[k]) ++k;
  if (k == seen.size() && k == script.size()) return;
  const bool sees = k < seen.size() && !is_own(seen[k].partner());
  if (k < script.size() && (k == seen.size() || script[k].key <= seen[k].key)) {
    if (is_own(script[k].partner()) && !sees) return;
    tasks_.push({.kind = Task::Kind::seed, .key = script[k].key, .a = g});
  } else if (sees) {
    tasks_.push({.kind = Task::Kind::seed, .key = seen[k].key, .a = g});
  }
}

/// Takes back what a sphere did from `key` on; who met it there must be looked at.
template <int D>
typename Region<D>::Mended& Region<D>::mend(Slot i, const EventKey<D>& key) {
  Nodes& path = rewritten(i);
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
    const auto script = script_.at(i);
    m.script = m.kept;
    m.strays = m.kept > script.size() || !std::equal(path.begin(), path.end(), script.begin());
  }
  for (const Node<D>& node : m.old) {
    const auto partner = slot_.find(node.partner());
    if (partner != slot_.end()) tasks_.push({.kind = Task::Kind::check, .key = node.key, .a = i, .b = partner->second});
  }
  return m;
}

template <int D>
void Region<D>::plan_script(Mended& m) {
  const auto script = script_.at(m.slot);
  if (m.strays || m.script >= script.size()) return;
  tasks_.push({.kind = Task::Kind::script,
               .key = script[m.script].key,
               .a = m.slot,
               .version_a = static_cast<std::uint32_t>(m.script)});
}

/// Plans all contacts that a mended sphere may have from `now` on.
template <int D>
void Region<D>::predict(Mended& m, const EventKey<D>& now) {
  const Packing<D>& packing = core_.packing();
  const bool ghost = role_[m.slot] == Role::ghost;
  for (const std::uint32_t candidate : ghost ? core_.find_near_at_border(m.slot) : core_.find_near(m.slot)) {
    const Slot j = packing.slot(candidate);
    if (j == m.slot || (ghost && role_[j] == Role::ghost)) continue;
    meet(m, j, packing.image(candidate), now);
  }
  predict_walls(m);
}

template <int D>
void Region<D>::meet(Mended& m, Slot j, const Image<D>& image, const EventKey<D>& now) {
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
  const auto path = this->path(j);
  std::size_t k = 0;
  while (k < path.size() && path[k].key < now) ++k;
  for (;; ++k) {
    const Record<D>& other = before(j, k);
    const double t = flights.pair_contact(m.slot, m.now, j, other, shift);
    if (t < end_)
      if (const EventKey<D> key = key_at(other, t); k == path.size() || key <= path[k].key) return plan(key);
    if (k == path.size()) return;
  }
}

template <int D>
void Region<D>::predict_walls(Mended& m) {
  for (int axis = 0; axis < D; ++axis)
    for (int side = 0; side < 2 && box_.walled(axis); ++side) {
      const double t = core_.flights().wall_contact(m.slot, m.now, axis, side);
      if (!(t < end_)) continue;
      tasks_.push({.kind = Task::Kind::contact,
                   .key = {.time = t,
                           .generation = Flights<D>::generation_at(m.now, t),
                           .kind = EventKind::wall,
                           .lo = m.now.id,
                           .hi = static_cast<Id>(2 * axis + side)},
                   .a = m.slot,
                   .version_a = m.version});
    }
}

template <int D>
void Region<D>::contact(const Task& task) {
  const EventKey<D>& key = task.key;
  const bool pair = key.kind == EventKind::pair;
  if (version(task.a) != task.version_a || (pair && version(task.b) != task.version_b)) return;
  ++redone_events_;
  Mended& a = mended(task.a) ? repairs_[mended_of_[task.a]] : mend(task.a, key);
  if (!pair) {
    Node<D> node{a.now, key};
    const int axis = static_cast<int>(key.hi / 2), side = static_cast<int>(key.hi % 2);
    node.overlap = core_.flights().bounce(a.slot, node.after, axis, side, key.time, key.generation).overlap;
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

/// Adds a node to a path. A ghost whose script has the same goes on with it.
template <int D>
void Region<D>::append(Mended& m, const Node<D>& node) {
  rewritten(m.slot).push_back(node);
  m.now = node.after;
  ++m.version;
  if (role_[m.slot] != Role::ghost || m.strays) return;
  const auto script = script_.at(m.slot);
  m.strays = m.script >= script.size() || !(script[m.script] == node);
  ++m.script;
  plan_script(m);
}

/// A ghost does what its owner says it did with others.
template <int D>
void Region<D>::script(const Task& task) {
  Mended& m = repairs_[mended_of_[task.a]];
  if (m.strays || m.script != task.version_a) return;
  const Node<D>& node = script_.at(task.a)[m.script];
  if (is_own(node.partner())) {  // who knows better: they did not meet
    m.strays = true;
    return;
  }
  append(m, node);
  predict(m, task.key);
}

/// A sphere that has been mended met this one here, and no longer does.
template <int D>
void Region<D>::check(const Task& task) {
  if (mended(task.b) || (role_[task.a] == Role::ghost && role_[task.b] == Role::ghost)) return;
  Mended& m = mend(task.b, task.key);
  if (role_[task.b] == Role::ghost) m.strays = true;
  predict(m, task.key);
}

template <int D>
bool Region<D>::agrees() const {
  return std::all_of(ghosts_.begin(), ghosts_.end(), [&](Slot g) {
    const auto seen = path(g), script = script_.at(g);
    return std::equal(seen.begin(), seen.end(), script.begin(), script.end());
  });
}

template <int D>
void Region<D>::cut(const EventKey<D>& last) {
  for (std::size_t q = 0; q < touched_.size(); ++q) {
    Nodes& path = rewritten(touched_[q]);
    path.erase(std::find_if(path.begin(), path.end(), [&](const Node<D>& n) { return last < n.key; }), path.end());
  }
}

template <int D>
void Region<D>::commit() {
  other_.clear();
  for (const Slot slot : rewritten_.who()) {
    const Record<D>& now = after(slot);
    const Record<D>& known = core_.flights()[slot];
    if (now.t != known.t || now.x != known.x || now.v != known.v || now.generation != known.generation)
      other_.emplace_back(slot, now);
  }
  core_.put(other_, end_);
  for (const Slot i : touched_) {
    length_[i] = 0;
    start_of_[i] = kNone;
  }
  touched_.clear();
  changed_.clear();
  start_.clear();
  rewritten_.clear();
  script_.clear();
}

template class Region<2>;
template class Region<3>;

}  // namespace carom
