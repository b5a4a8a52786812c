// SPDX-License-Identifier: BSD-3-Clause
#include "engine/ranks/window_repair.h"

#include <algorithm>

namespace carom {

template <int D>
std::vector<Slot> WindowRepair<D>::run(double end) {
  end_ = end;
  events_ = 0;
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
      case Task::Kind::difference:
        difference(task);
    }
  }
  std::vector<Slot> changed;
  for (const Slot i : repairs_.slots())
    if (!ownership_.owns(i))
      paths_.add_unmatched(i);
    else if (paths_.path(i) != repairs_.at(i).old)
      changed.push_back(i);
  return changed;
}

/// Starts a repair where the path of a ghost differs from its script. A difference that is only a contact with an own
/// sphere starts none, because this subdomain decides such contacts.
template <int D>
void WindowRepair<D>::compare(Slot g) {
  if (paths_.matches(g) || adopt(g)) return;
  paths_.add_unmatched(g);
  const auto computed = paths_.events(g), script = paths_.script(g);
  const auto [here, there] = std::mismatch(computed.begin(), computed.end(), script.begin(), script.end());
  const bool without_own = here != computed.end() && !ownership_.owns_id(here->partner());
  if (there != script.end() && (here == computed.end() || there->key <= here->key)) {
    if (ownership_.owns_id(there->partner()) && !without_own) return;
    tasks_.push({.kind = Task::Kind::difference, .key = there->key, .a = g});
  } else if (without_own) {
    tasks_.push({.kind = Task::Kind::difference, .key = here->key, .a = g});
  }
}

/// Cuts the path of a sphere at `key`. If path and script are equal up to there, the ghost follows its script from then
/// on. Each partner of a removed event gets a task, because it may no longer meet this sphere.
template <int D>
typename WindowRepair<D>::Repaired& WindowRepair<D>::begin(Slot i, const EventKey<D>& key) {
  auto& path = paths_.path(i);
  const auto from = std::find_if(path.begin() + 1, path.end(), [&](const Node<D>& node) { return !(node.key < key); });
  Repaired& m = repairs_.add(i);
  m.slot = i;
  m.version = 1;
  m.old = path;
  for (auto node = from; node != path.end(); ++node) {
    if (node->key.kind != EventKind::pair) continue;
    const Slot partner = ownership_.slot_of(node->partner());
    if (partner != IdTable::kNowhere && (ownership_.owns(i) || ownership_.owns(partner)))
      tasks_.push({.kind = Task::Kind::difference, .key = node->key, .a = partner});
  }
  path.erase(from, path.end());
  const auto [last, next] = std::ranges::mismatch(paths_.events(i), paths_.script(i));
  m.left_script = last != paths_.events(i).end() || (next != paths_.script(i).end() && next->key < key);
  plan_script(m);
  return m;
}

/// The next node in the script of a ghost; null if there is none or the ghost has left its script.
template <int D>
const Node<D>* WindowRepair<D>::next_of_script(const Repaired& m) {
  const auto script = paths_.script(m.slot);
  const std::size_t next = paths_.events(m.slot).size();
  return m.left_script || next >= script.size() ? nullptr : &script[next];
}

template <int D>
void WindowRepair<D>::plan_script(const Repaired& m) {
  if (const Node<D>* next = next_of_script(m))
    tasks_.push({.kind = Task::Kind::script, .key = next->key, .a = m.slot, .version_a = m.version});
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
  if (!met) paths_.path(g).insert(paths_.path(g).end(), script.begin(), script.end());
  return !met;
}

/// Calls visit(j, image) for the spheres with wanted(j) that sphere `i` may touch before the end of the window if it
/// has this record. False for a ghost that can meet no own sphere.
template <int D>
template <class Wanted, class Visit>
bool WindowRepair<D>::visit_near(Slot i, const Record<D>& r, Wanted&& wanted, Visit&& visit) {
  const bool ghost = ownership_.is_ghost(i);
  Vec<D> low, high;
  if (ghost && !ownership_.meeting_place(i, r, end_, low, high)) return false;
  for (const std::uint32_t candidate :
       ghost ? core_.find_near_at_border(i, low, high, r.x, ownership_.way(r, end_)) : core_.find_near(i)) {
    const Slot j = flights_.packing().slot(candidate);
    if (!wanted(j)) continue;
    const Image<D> image = flights_.packing().image(candidate);
    if (ownership_.may_meet(r, j, box_.offset(image), end_)) visit(j, image);
  }
  return true;
}

/// Plans all contacts that a repaired sphere may have after `now`.
template <int D>
void WindowRepair<D>::predict(const Repaired& m, const EventKey<D>& now) {
  const Record<D>& r = paths_.after(m.slot);
  const bool ghost = ownership_.is_ghost(m.slot);
  const auto wanted = [&](Slot j) { return j != m.slot && (!ghost || ownership_.owns(j)); };
  if (!visit_near(m.slot, r, wanted, [&](Slot j, const Image<D>& image) {
        EventKey<D> key;
        if (meets(m.slot, r, j, image, now, key))
          tasks_.push({.kind = Task::Kind::contact,
                       .key = key,
                       .a = m.slot,
                       .b = j,
                       .version_a = m.version,
                       .version_b = version(j),
                       .image = image});
      }))
    return;
  flights_.visit_lone_events(m.slot, r, [&](double t, EventKind kind, Id number) {
    if (!(t < end_)) return;
    const std::uint32_t generation = Flights<D>::generation_at(r, t);
    tasks_.push(
        {.kind = Task::Kind::contact, .key = {t, generation, kind, r.id, number}, .a = m.slot, .version_a = m.version});
  });
}

/// Whether sphere `i`, if it has record r from `now` on, meets another one in the window, and the contact.
template <int D>
bool WindowRepair<D>::meets(Slot i, const Record<D>& r, Slot j, const Image<D>& image, const EventKey<D>& now,
                            EventKey<D>& key) {
  const Offset<D> offset = box_.offset(image);
  const auto touches = [&](const Record<D>& other) {
    const double t = flights_.pair_contact(i, r, j, other, offset);
    if (!(t < end_)) return false;
    const auto generation = std::max(Flights<D>::generation_at(r, t), Flights<D>::generation_at(other, t));
    key = pair_key<D>(t, generation, r.id, other.id, image);
    return true;
  };
  if (repairs_.has(j) || paths_.has_no_events(j)) return touches(paths_.after(j));
  // Along its path a contact counts only before the next node.
  const auto& path = paths_.path(j);
  std::size_t k = 1;
  while (k < path.size() && path[k].key < now) ++k;
  for (; k <= path.size(); ++k)
    if (touches(path[k - 1].after) && (k == path.size() || key <= path[k].key)) return true;
  return false;
}

template <int D>
void WindowRepair<D>::contact(const Task& task) {
  const EventKey<D>& key = task.key;
  const bool pair = key.kind == EventKind::pair;
  if (version(task.a) != task.version_a || (pair && version(task.b) != task.version_b)) return;
  ++events_;
  Repaired& a = repaired_at(task.a, key);
  Node<D> of_a = paths_.path(task.a).back();
  of_a.key = key;
  if (!pair) {
    flights_.meet_alone(key, task.a, of_a.after, &of_a.internal);
    append(a, of_a);
    return predict(a, key);
  }
  Repaired& b = repaired_at(task.b, key);
  Node<D> of_b = paths_.path(task.b).back();
  of_b.key = key;
  flights_.collide(task.a, of_a.after, of_a.internal, task.b, of_b.after, of_b.internal, box_.offset(task.image),
                   key.time, key.generation);
  append(a, of_a);
  append(b, of_b);
  predict(a, key);
  predict(b, key);
}

/// Appends a node to a path. A ghost follows its script while the script has the same nodes.
template <int D>
void WindowRepair<D>::append(Repaired& m, const Node<D>& node) {
  const Node<D>* const next = next_of_script(m);
  m.left_script = !next || !(*next == node);
  ++m.version;
  paths_.append(m.slot, node);
  plan_script(m);
}

/// Executes a script event of a ghost, alone or with another ghost.
template <int D>
void WindowRepair<D>::script(const Task& task) {
  Repaired& m = repairs_.at(task.a);
  if (m.left_script || m.version != task.version_a) return;
  const Node<D>& node = *next_of_script(m);
  if (ownership_.owns_id(node.partner()))
    m.left_script = true;  // they did not meet here, and this subdomain decides contacts of own spheres
  else
    append(m, node);
  predict(m, task.key);
}

/// Repairs a ghost that differs from its script, or a sphere that met a repaired one before: they may no longer meet.
template <int D>
void WindowRepair<D>::difference(const Task& task) {
  if (repairs_.has(task.a)) return;
  const Repaired& m = begin(task.a, task.key);
  if (const Node<D>* next = next_of_script(m); !next || next->key != task.key) predict(m, task.key);
}

template class WindowRepair<2>;
template class WindowRepair<3>;

}  // namespace carom
