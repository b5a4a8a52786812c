// SPDX-License-Identifier: BSD-3-Clause
#include "engine/ranks/window_paths.h"

#include <algorithm>
#include <cstring>

namespace carom {

template <int D>
void WindowPaths<D>::load(std::size_t slots) {
  trace_.clear(slots);
  paths_.clear();
  paths_.resize(slots);
  scripts_.clear();
  scripts_.resize(slots);
  rewritten_.assign(slots, 0);
  listed_.assign(slots, 0);
}

template <int D>
Trace<D>& WindowPaths<D>::start() {
  trace_.clear(flights_.capacity());
  return trace_;
}

template <int D>
std::vector<Slot> WindowPaths<D>::end() {
  std::vector<Slot> seen;
  take_unmatched();
  const auto prefetch = [&](Slot i) { ownership_.prefetch(i); };
  trace_.link(prefetch, [&](Slot i, bool first) {
    if (!ownership_.turn(i) || !first || (!ownership_.is_seen(i) && !ownership_.is_ghost(i))) return;
    prefetch_line(&flights_[i]);  // its path will be read
    if (ownership_.is_seen(i))
      seen.push_back(i);
    else
      add_unmatched(i);
  });
  return seen;
}

template <int D>
std::vector<typename EventCore<D>::Changed> WindowPaths<D>::finish() {
  std::vector<typename EventCore<D>::Changed> other;
  for (const Slot slot : paths_.slots()) {
    if (rewritten_[slot] == 0) continue;
    rewritten_[slot] = 0;
    const Record<D>&now = after(slot), &known = flights_[slot];
    const Spin<D> spin = spin_after(slot);
    if (now.t != known.t || now.x != known.x || now.v != known.v || now.generation != known.generation ||
        spin != flights_.spin(slot))
      other.push_back({slot, now, spin});
  }
  paths_.clear();
  scripts_.clear();
  return other;
}

/// Node k of a path, read from the log; `entries`: the sphere's entries.
template <int D>
Node<D> WindowPaths<D>::logged(Slot i, std::span<const std::uint32_t> entries, std::size_t k) const {
  const auto& event = trace_.event_of(entries[k]);
  const auto& [lo, hi] = event.id;
  return {.after = k + 1 < entries.size() ? trace_.before(entries[k + 1]) : flights_[i],
          .key = event.slot[1] == kNoEntry
                     ? EventKey<D>{event.time, event.generation, EventKind::wall, lo, event.partner}
                     : pair_key<D>(event.time, event.generation, lo, hi, flights_.packing().image(event.partner)),
          .spin = k + 1 < entries.size() ? trace_.spin_before(entries[k + 1]) : flights_.spin(i),
          .exchange = event.exchange,
          .overlap = event.overlap};
}

template <int D>
typename WindowPaths<D>::Path& WindowPaths<D>::path_of(Slot i) {
  if (paths_.has(i)) return paths_.at(i);
  const Record<D> first = start(i);
  const View logged = view(i);
  Path& path = paths_.add(i);
  path.start = first;
  path.spin = logged.entries.empty() ? flights_.spin(i) : trace_.spin_before(logged.entries[0]);
  path.nodes.clear();
  for (std::size_t k = 0; k < logged.size(); ++k) path.nodes.push_back(logged.node(k));
  return path;
}

template <int D>
const Record<D>& WindowPaths<D>::start(Slot i) const {
  const View path = view(i);
  if (path.nodes) return paths_.at(i).start;
  return path.size() == 0 ? flights_[i] : trace_.before(path.entries[0]);
}

template <int D>
const Record<D>& WindowPaths<D>::after(Slot i) const {
  if (!paths_.has(i)) return flights_[i];
  const Path& path = paths_.at(i);
  return path.nodes.empty() ? path.start : path.nodes.back().after;
}

template <int D>
Spin<D> WindowPaths<D>::spin_after(Slot i) const {
  if (!paths_.has(i)) return flights_.spin(i);
  const Path& path = paths_.at(i);
  return path.nodes.empty() ? path.spin : path.nodes.back().spin;
}

template <int D>
typename WindowPaths<D>::Nodes& WindowPaths<D>::rewrite(Slot i) {
  rewritten_[i] = 1;
  return path_of(i).nodes;
}

template <int D>
void WindowPaths<D>::cut(const EventKey<D>& last) {
  std::vector<Slot> touched(paths_.slots().begin(), paths_.slots().end());
  for_each_own([&](Slot i) { touched.push_back(i); });
  for (const Slot i : touched)
    if (const std::size_t k = nodes(i); k > 0 && last < node(i, k - 1).key)
      std::erase_if(rewrite(i), [&](const Node<D>& node) { return last < node.key; });
}

template <int D>
void WindowPaths<D>::write(Slot i, Bytes& to) const {
  const View path = view(i);
  const ScriptHead head{flights_[i].id, path.size()};
  std::size_t at = to.size(), bytes = node_bytes();
  to.resize(at + sizeof head + head.nodes * bytes);
  std::memcpy(to.data() + at, &head, sizeof head);
  at += sizeof head;
  for (std::size_t k = 0; k < head.nodes; ++k, at += bytes) {
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
    if (!(path.node(k) == sent[k])) return false;
  return true;
}

template <int D>
bool WindowPaths<D>::all_match(double end) {
  const auto until = [&](std::span<const Node<D>> nodes) {
    while (!nodes.empty() && nodes.back().key.time >= end) nodes = nodes.first(nodes.size() - 1);
    return nodes;
  };
  return std::ranges::all_of(
      unmatched_, [&](Slot g) { return matches(g) || std::ranges::equal(until(path(g)), until(script(g))); });
}

template <int D>
ContactTally WindowPaths<D>::tally() const {
  ContactTally tally;
  const auto add = [&](Id wall, double time, const PackedExchange& exchange, double overlap) {
    if (wall == kNoEntry) return tally.add_pair(exchange.unpacked<D>(nullptr, time), overlap);
    const auto its = std::ranges::find(flights_.walls(), wall, &Wall<D>::number);
    tally.add_wall(wall, exchange.unpacked(&*its, time), overlap);
  };
  for (const auto& event : trace_.events())
    if (const Slot lo = event.slot[0]; ownership_.owns(lo) && rewritten_[lo] == 0)
      add(event.slot[1] != kNoEntry ? kNoEntry : event.partner, event.time, event.exchange, event.overlap);
  for (const Slot i : paths_.slots()) {
    if (!ownership_.owns(i) || rewritten_[i] == 0) continue;
    for (const Node<D>& node : paths_.at(i).nodes)
      if (node.key.lo == node.after.id)
        add(node.key.kind == EventKind::pair ? kNoEntry : node.key.hi, node.key.time, node.exchange, node.overlap);
  }
  return tally;
}

template class WindowPaths<2>;
template class WindowPaths<3>;

}  // namespace carom
