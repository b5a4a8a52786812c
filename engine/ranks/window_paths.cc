// SPDX-License-Identifier: BSD-3-Clause
#include "engine/ranks/window_paths.h"

#include <algorithm>
#include <cstring>

namespace carom {

template <int D>
Trace<D>& WindowPaths<D>::start_log() {
  trace_.clear(flights_.capacity(), flights_.shear_rate());
  return trace_;
}

template <int D>
std::vector<Slot> WindowPaths<D>::link_log() {
  std::vector<Slot> seen;
  take_unmatched();
  const auto prefetch = [&](Slot i) { ownership_.prefetch(i); };
  trace_.link(prefetch, [&](Slot i, bool first) {
    if (!ownership_.note_event(i) || !first || (!ownership_.is_seen(i) && !ownership_.is_ghost(i))) return;
    prefetch_line(&flights_[i]);  // its path will be read
    if (ownership_.is_seen(i))
      seen.push_back(i);
    else
      add_unmatched(i);
  });
  return seen;
}

template <int D>
std::vector<typename EventCore<D>::Changed> WindowPaths<D>::take_changes() {
  std::vector<typename EventCore<D>::Changed> other;
  for (const Slot slot : paths_.slots()) {
    const Record<D>&now = after(slot), &known = flights_[slot];
    const Internal<D> internal = internal_after(slot);
    if (now.t != known.t || now.x != known.x || now.v != known.v || now.generation != known.generation ||
        internal != flights_.internal(slot))
      other.push_back({slot, now, internal});
  }
  paths_.clear();
  scripts_.clear();
  return other;
}

/// The key of the event with an entry in the log.
template <int D>
EventKey<D> WindowPaths<D>::key_of(std::uint32_t entry) const {
  const auto& event = trace_.event_of(entry);
  const Id lo = trace_.before(entry / 2 * 2).id, hi = trace_.before(entry / 2 * 2 + 1).id;
  return event.kind == EventKind::pair
             ? pair_key<D>(event.time, event.generation, lo, hi, flights_.packing().image(event.partner))
             : EventKey<D>{event.time, event.generation, event.kind, lo, event.partner};
}

/// Node k of a path, read from the log; `entries`: the sphere's entries.
template <int D>
Node<D> WindowPaths<D>::logged(Slot i, std::span<const std::uint32_t> entries, std::size_t k) const {
  const bool last = k == entries.size();
  return {.after = last ? flights_[i] : trace_.before(entries[k]),
          .key = k == 0 ? EventKey<D>{} : key_of(entries[k - 1]),
          .internal = last ? flights_.internal(i) : trace_.internal_before(entries[k])};
}

template <int D>
typename WindowPaths<D>::Nodes& WindowPaths<D>::path(Slot i) {
  if (paths_.has(i)) return paths_.at(i);
  const View logged = view(i);
  Nodes& nodes = paths_.add(i);
  nodes.clear();
  for (std::size_t k = 0; k <= logged.size(); ++k) nodes.push_back(logged.node(k));
  return nodes;
}

template <int D>
void WindowPaths<D>::cut(const EventKey<D>& last) {
  std::vector<Slot> touched(paths_.slots().begin(), paths_.slots().end());
  for_each_own([&](Slot i) { touched.push_back(i); });
  for (const Slot i : touched) {
    if (size(i) == 0 || !(last < node(i, size(i)).key)) continue;
    const auto later = std::ranges::find_if(events(i), [&](const Node<D>& node) { return last < node.key; });
    path(i).resize(1 + static_cast<std::size_t>(later - events(i).begin()));
  }
}

template <int D>
void WindowPaths<D>::write(Slot i, Bytes& to) const {
  const View path = view(i);
  const ScriptHead head{flights_[i].id, path.size()};
  std::size_t at = to.size(), bytes = node_bytes();
  to.resize(at + sizeof head + head.nodes * bytes);
  std::memcpy(to.data() + at, &head, sizeof head);
  at += sizeof head;
  for (std::size_t k = 1; k <= head.nodes; ++k, at += bytes) {
    const Node<D> node = path.node(k);
    std::memcpy(to.data() + at, static_cast<const void*>(&node), bytes);
  }
}

template <int D>
void WindowPaths<D>::read_script(Reader& message) {
  const auto [id, count] = message.get<ScriptHead>();
  const std::byte* const bytes = message.skip(count * node_bytes());
  const Slot g = ownership_.slot_of(id);
  if (g == IdTable::kNowhere) return;  // there was no room for this ghost, so the window will be revoked
  Nodes& nodes = scripts_.has(g) ? scripts_.at(g) : scripts_.add(g);
  nodes.resize(count);
  for (std::size_t k = 0; k < count; ++k)
    std::memcpy(static_cast<void*>(&nodes[k]), bytes + k * node_bytes(), node_bytes());
  add_unmatched(g);
}

template <int D>
bool WindowPaths<D>::matches(Slot g) const {
  const View path = view(g);
  const auto sent = script(g);
  if (path.size() != sent.size()) return false;
  for (std::size_t k = 0; k < sent.size(); ++k)
    if (path.node(k + 1) != sent[k]) return false;
  return true;
}

template <int D>
ContactTally WindowPaths<D>::tally() const {
  ContactTally tally;
  for (std::uint32_t n = 0; n < trace_.events().size(); ++n) {
    const auto& event = trace_.events()[n];
    const Slot lo = event.slot[0], hi = event.slot[1];  // clang 14 cannot capture a structured binding
    if (!ownership_.owns(lo) || paths_.has(lo)) continue;
    const bool pair = event.kind == EventKind::pair;
    tally.add(event.kind, event.partner,
              event.exchange.unpacked(event.kind, event.pair_event, event.partner, box_, event.time));
    tally.note_overlap(event.overlap, [&] {
      return Overlap(event.overlap, pair ? flights_.contact_distance(lo, hi) : flights_.radius(lo), key_of(2 * n));
    });
  }
  for (const Slot i : paths_.slots()) {
    if (!ownership_.owns(i)) continue;
    for (std::size_t k = 1; k < paths_.at(i).size(); ++k)
      if (const Node<D>& node = paths_.at(i)[k]; node.key.lo == node.after.id)
        tally.record<D>(contact_of(i, k), nullptr);
  }
  return tally;
}

template <int D>
Contact<D> WindowPaths<D>::contact_of(Slot lo, std::size_t k) const {
  const View path = view(lo);
  const EventKey<D> key = path.node(k).key;
  Node<D> a = path.node(k - 1);
  if (key.kind != EventKind::pair) {
    const EventResult<D> result = flights_.meet_alone(key, lo, a.after, &a.internal);
    return flights_.contact_of(key, a.after, result);
  }
  const Slot hi = ownership_.slot_of(key.hi);
  const View other = view(hi);
  std::size_t before = 0;
  while (other.node(before + 1).key != key) ++before;
  Node<D> b = other.node(before);
  const Offset<D> offset = box_.offset(key.image);
  const EventResult<D> result =
      flights_.collide(lo, a.after, a.internal, hi, b.after, b.internal, offset, key.time, key.generation);
  return flights_.contact_of(key, a.after, b.after, offset, result);
}

template class WindowPaths<2>;
template class WindowPaths<3>;

}  // namespace carom
