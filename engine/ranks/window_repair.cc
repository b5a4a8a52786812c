// SPDX-License-Identifier: BSD-3-Clause
#include "engine/ranks/window_repair.h"

#include <algorithm>

namespace carom {

template <int D>
std::vector<Slot> WindowRepair<D>::run() {
  repairs_.clear();
  for (const Slot g : paths_.take_unmatched()) compare(g);
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
      case Task::Kind::difference:
        if (repaired(task.a)) break;
        Repaired& m = begin(task.a, task.key);
        plan_script(m);
        if (const Node<D>* next = next_of_script(m); !next || next->key != task.key) predict(m, task.key);
    }
  }
  std::vector<Slot> changed;
  for (const Repaired& m : repairs_) {
    repair_of_[m.slot] = kNoRepair;
    if (!ownership_.owns(m.slot)) {
      paths_.add_unmatched(m.slot);
      continue;
    }
    const auto now = paths_.path(m.slot).subspan(m.kept);
    if (!std::equal(now.begin(), now.end(), m.old.begin(), m.old.end())) changed.push_back(m.slot);
  }
  return changed;
}

/// Starts a repair where the path of a ghost differs from its script, except by a contact with an own sphere.
template <int D>
void WindowRepair<D>::compare(Slot g) {
  if (paths_.matches(g) || adopt(g)) return;
  paths_.add_unmatched(g);
  const auto seen = paths_.path(g), script = paths_.script(g);
  const auto [here, there] = std::mismatch(seen.begin(), seen.end(), script.begin(), script.end());
  const bool sees = here != seen.end() && !ownership_.owns_id(here->partner());
  if (there != script.end() && (here == seen.end() || there->key <= here->key)) {
    if (ownership_.owns_id(there->partner()) && !sees) return;
    tasks_.push({.kind = Task::Kind::difference, .key = there->key, .a = g});
  } else if (sees) {
    tasks_.push({.kind = Task::Kind::difference, .key = here->key, .a = g});
  }
}

/// Cuts the path of a sphere at `key`; the partners of the removed events must be checked.
template <int D>
typename WindowRepair<D>::Repaired& WindowRepair<D>::begin(Slot i, const EventKey<D>& key) {
  auto& path = paths_.rewrite(i);
  const auto from = std::find_if(path.begin(), path.end(), [&](const Node<D>& n) { return !(n.key < key); });
  repair_of_[i] = static_cast<std::uint32_t>(repairs_.size());
  Repaired& m = repairs_.emplace_back();
  m.slot = i;
  m.version = 1;
  m.kept = static_cast<std::size_t>(from - path.begin());
  m.old.assign(from, path.end());
  path.erase(from, path.end());
  m.now = paths_.before(i, m.kept);
  m.spin = paths_.spin_before(i, m.kept);
  if (ownership_.is_ghost(i)) {
    const auto script = paths_.script(i);
    m.script = m.kept;
    m.left_script = m.kept > script.size() || !std::equal(path.begin(), path.end(), script.begin());
  }
  for (const Node<D>& node : m.old) {
    if (node.key.kind == EventKind::wall) continue;
    const Slot partner = ownership_.slot_of(node.partner());
    if (partner != IdTable::kNowhere) tasks_.push({.kind = Task::Kind::check, .key = node.key, .a = i, .b = partner});
  }
  return m;
}

/// The next node in the script of a ghost; null if there is none or the ghost has left its script.
template <int D>
const Node<D>* WindowRepair<D>::next_of_script(const Repaired& m) {
  const auto script = paths_.script(m.slot);
  return m.left_script || m.script >= script.size() ? nullptr : &script[m.script];
}

template <int D>
void WindowRepair<D>::plan_script(Repaired& m) {
  if (const Node<D>* next = next_of_script(m))
    tasks_.push(
        {.kind = Task::Kind::script, .key = next->key, .a = m.slot, .version_a = static_cast<std::uint32_t>(m.script)});
}

/// Replaces the path of a ghost by its script if it had no events here and, on its script, meets no own sphere with
/// events; returns whether it did. So most ghosts are repaired: their partners are farther from the border. Contacts
/// with spheres without events are in the script, because the ghost's owner has these spheres.
template <int D>
bool WindowRepair<D>::adopt(Slot g) {
  if (!paths_.has_no_events(g)) return false;
  const auto script = paths_.script(g);
  for (const Node<D>& node : script)
    if (ownership_.owns_id(node.partner())) return false;
  bool met = false;
  const auto moved = [&](Slot j) { return !paths_.has_no_events(j) && ownership_.owns(j); };
  for (std::size_t k = 0; k < script.size() && !met; ++k)
    visit_near(g, script[k].after, moved, [&](Slot j, const Image<D>& image) {
      EventKey<D> key;
      met = met || (meets(g, script[k].after, j, image, script[k].key, key) &&
                    (k + 1 == script.size() || key <= script[k + 1].key));
    });
  if (!met) paths_.rewrite(g).assign(script.begin(), script.end());
  return !met;
}

/// Calls visit(j, image) for the spheres with wanted(j) that sphere `i` may touch before the end of the window if it
/// has this record. False for a ghost that can meet no own sphere.
template <int D>
template <class Wanted, class Visit>
bool WindowRepair<D>::visit_near(Slot i, const Record<D>& r, Wanted&& wanted, Visit&& visit) {
  const bool ghost = ownership_.is_ghost(i);
  Vec<D> low, high;
  if (ghost && !ownership_.meeting_place(r, end_, low, high)) return false;
  for (const std::uint32_t candidate : ghost ? core_.find_near_at_border(i, low, high) : core_.find_near(i)) {
    const Slot j = flights_.packing().slot(candidate);
    if (!wanted(j)) continue;
    const Image<D> image = flights_.packing().image(candidate);
    if (ownership_.may_meet(r, j, box_.shift(image), end_)) visit(j, image);
  }
  return true;
}

/// Plans all contacts that a repaired sphere may have after `now`.
template <int D>
void WindowRepair<D>::predict(Repaired& m, const EventKey<D>& now) {
  const bool ghost = ownership_.is_ghost(m.slot);
  const auto wanted = [&](Slot j) { return j != m.slot && (!ghost || ownership_.owns(j)); };
  if (!visit_near(m.slot, m.now, wanted, [&](Slot j, const Image<D>& image) {
        EventKey<D> key;
        if (meets(m.slot, m.now, j, image, now, key))
          tasks_.push({.kind = Task::Kind::contact,
                       .key = key,
                       .a = m.slot,
                       .b = j,
                       .version_a = m.version,
                       .version_b = version(j),
                       .image = image});
      }))
    return;
  for (const Wall<D>& wall : flights_.walls()) {
    const double t = flights_.wall_contact(m.slot, m.now, wall);
    if (!(t < end_)) continue;
    const std::uint32_t generation = Flights<D>::generation_at(m.now, t);
    tasks_.push({.kind = Task::Kind::contact,
                 .key = {t, generation, EventKind::wall, m.now.id, wall.number},
                 .a = m.slot,
                 .version_a = m.version});
  }
}

/// Whether sphere `i`, if it has record r from `now` on, meets another one in the window, and the contact.
template <int D>
bool WindowRepair<D>::meets(Slot i, const Record<D>& r, Slot j, const Image<D>& image, const EventKey<D>& now,
                            EventKey<D>& key) {
  const Vec<D> shift = box_.shift(image);
  const auto touches = [&](const Record<D>& other) {
    const double t = flights_.pair_contact(i, r, j, other, shift);
    if (!(t < end_)) return false;
    const auto generation = std::max(Flights<D>::generation_at(r, t), Flights<D>::generation_at(other, t));
    key = pair_key<D>(t, generation, r.id, other.id, image);
    return true;
  };
  if (repaired(j)) return touches(repairs_[repair_of_[j]].now);
  if (paths_.has_no_events(j)) return touches(paths_.after(j));
  // Along its path a contact counts only before the next node.
  const auto path = paths_.path(j);
  std::size_t k = 0;
  while (k < path.size() && path[k].key < now) ++k;
  for (; k <= path.size(); ++k)
    if (touches(paths_.before(j, k)) && (k == path.size() || key <= path[k].key)) return true;
  return false;
}

template <int D>
void WindowRepair<D>::contact(const Task& task) {
  const EventKey<D>& key = task.key;
  const bool pair = key.kind == EventKind::pair;
  if (version(task.a) != task.version_a || (pair && version(task.b) != task.version_b)) return;
  ++events_;
  Repaired& a = repaired_at(task.a, key);
  Node<D> of_a{.after = a.now, .key = key, .spin = a.spin};
  if (!pair) {
    const Wall<D> wall = box_.wall(key.hi);
    const Impact<D> impact = flights_.bounce(a.slot, of_a.after, &of_a.spin, wall, key.time, key.generation);
    of_a.exchange = {key.kind, impact.exchange};
    of_a.overlap = impact.overlap;
    append(a, of_a);
    return predict(a, key);
  }
  Repaired& b = repaired_at(task.b, key);
  Node<D> of_b{.after = b.now, .key = key, .spin = b.spin};
  const Impact<D> impact = flights_.collide(a.slot, of_a.after, &of_a.spin, b.slot, of_b.after, &of_b.spin,
                                            box_.shift(task.image), key.time, key.generation);
  of_a.exchange = of_b.exchange = {key.kind, impact.exchange};
  of_a.overlap = of_b.overlap = impact.overlap;
  append(a, of_a);
  append(b, of_b);
  predict(a, key);
  predict(b, key);
}

/// Appends a node to a path. A ghost follows its script while the script has the same nodes.
template <int D>
void WindowRepair<D>::append(Repaired& m, const Node<D>& node) {
  paths_.rewrite(m.slot).push_back(node);
  m.now = node.after;
  m.spin = node.spin;
  fastest_squared_ = std::max(fastest_squared_, node.after.v.squaredNorm());
  ++m.version;
  if (!ownership_.is_ghost(m.slot) || m.left_script) return;
  const Node<D>* const next = next_of_script(m);
  m.left_script = !next || !(*next == node);
  ++m.script;
  plan_script(m);
}

/// Executes a script event of a ghost with another ghost or a wall.
template <int D>
void WindowRepair<D>::script(const Task& task) {
  Repaired& m = repairs_[repair_of_[task.a]];
  if (m.left_script || m.script != task.version_a) return;
  const Node<D>& node = *next_of_script(m);
  if (ownership_.owns_id(node.partner()))
    m.left_script = true;  // they did not meet here, and this subdomain decides contacts of own spheres
  else
    append(m, node);
  predict(m, task.key);
}

/// Checks a sphere that met a repaired one before the repair: they may no longer meet.
template <int D>
void WindowRepair<D>::check(const Task& task) {
  const bool ghost = ownership_.is_ghost(task.b);
  if (repaired(task.b) || (ownership_.is_ghost(task.a) && ghost)) return;
  Repaired& m = begin(task.b, task.key);
  m.left_script = m.left_script || ghost;
  predict(m, task.key);
}

template class WindowRepair<2>;
template class WindowRepair<3>;

}  // namespace carom
