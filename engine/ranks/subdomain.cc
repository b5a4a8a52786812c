#include "engine/ranks/subdomain.h"

#include <algorithm>
#include <cstring>

namespace carom {

template <int D>
double Subdomain<D>::run(double now, double end) {
  end_ = end;
  length_ = end - now;
  trace_.clear(core_.flights().room());
  mended_fastest_squared_ = 0;
  Counters unused;
  double reached = end;
  try {
    core_.run(end, {.counters = unused, .trace = &trace_});
  } catch (LogFull) {
    reached = core_.now();
  }
  run_events_ += trace_.events().size();
  index();
  return reached;
}

/// Lists the spheres with events that are ghosts elsewhere, and the ghosts with events.
template <int D>
void Subdomain<D>::index() {
  changed_.clear();
  touched_ghosts_.clear();
  ++window_;
  for (const auto& event : trace_.events())
    for (const int which : {0, 1}) {
      const Slot i = event.slot[which];
      if (i == kNone || event.last[which] != kNone) continue;
      if (role_[i] == Role::seen) changed_.push_back(i);
      if (role_[i] == Role::ghost) touched_ghosts_.push_back(i);
    }
}

/// Node k of a path, as the trace has it, given the entries of the sphere.
template <int D>
Node<D> Subdomain<D>::traced(Slot i, std::span<const std::uint32_t> entries, std::size_t k) const {
  const auto& event = trace_.event_of(entries[k]);
  return {.after = k + 1 < entries.size() ? trace_.before(entries[k + 1]) : core_.flights()[i],
          .key = key_of(event),
          .virial = event.virial,
          .overlap = event.overlap};
}

template <int D>
typename Subdomain<D>::Path& Subdomain<D>::path_of(Slot i) {
  if (paths_.has(i)) return paths_.at(i);
  Path& path = paths_.add(i);
  const auto entries = trace_.entries(i);
  path.start = entries.empty() ? core_.flights()[i] : trace_.before(entries[0]);
  path.nodes.clear();
  for (std::size_t k = 0; k < entries.size(); ++k) path.nodes.push_back(traced(i, entries, k));
  return path;
}

template <int D>
void Subdomain<D>::write_path(Slot i, Bytes& to) const {
  if (paths_.has(i)) {
    const Nodes& nodes = paths_.at(i).nodes;
    put(to, static_cast<std::uint32_t>(nodes.size()));
    for (const Node<D>& node : nodes) put(to, node);
    return;
  }
  const auto entries = trace_.entries(i);
  put(to, static_cast<std::uint32_t>(entries.size()));
  for (std::size_t k = 0; k < entries.size(); ++k) put(to, traced(i, entries, k));
}

template <int D>
EventKey<D> Subdomain<D>::key_of(const typename Trace<D>::Event& event) const {
  const auto& [lo, hi] = event.id;
  if (event.slot[1] == kNone)
    return {.time = event.time, .generation = event.generation, .kind = EventKind::wall, .lo = lo, .hi = event.partner};
  return pair_key<D>(event.time, event.generation, lo, hi, core_.packing().image(event.partner));
}

/// A path that is going to be changed.
template <int D>
typename Subdomain<D>::Path& Subdomain<D>::rewritten(Slot i) {
  rewritten_[i] = 1;
  agreed_[i] = 0;
  return path_of(i);
}

template <int D>
const Record<D>& Subdomain<D>::after(Slot i) const {
  if (!paths_.has(i)) return core_.flights()[i];
  const Path& path = paths_.at(i);
  return path.nodes.empty() ? path.start : path.nodes.back().after;
}

template <int D>
bool Subdomain<D>::is_own_id(Id id) const {
  const Slot i = slots_.find(id);
  return i != IdTable::kNowhere && is_own(i);
}

template <int D>
void Subdomain<D>::follow(Id id, Reader& message) {
  const Slot g = slots_.find(id);
  Script& script = scripts_.has(g) ? scripts_.at(g) : scripts_.add(g);
  script.count = message.get<std::uint32_t>();
  script.bytes = message.skip(script.count * sizeof(Node<D>));
  script.nodes.clear();
  agreed_[g] = 0;
}

template <int D>
Node<D> Subdomain<D>::Script::node(std::size_t k) const {
  Node<D> node;
  std::memcpy(static_cast<void*>(&node), bytes + k * sizeof node, sizeof node);
  return node;
}

template <int D>
std::span<const Node<D>> Subdomain<D>::script_of(Slot g) {
  if (!scripts_.has(g)) return {};
  Script& script = scripts_.at(g);
  while (script.nodes.size() < script.count) script.nodes.push_back(script.node(script.nodes.size()));
  return script.nodes;
}

/// Whether the path of a ghost here is its script.
template <int D>
bool Subdomain<D>::matches(Slot g) {
  if (agreed_[g] == window_) return true;
  const std::size_t count = scripts_.has(g) ? scripts_.at(g).count : 0;
  std::size_t k = 0;
  if (paths_.has(g)) {
    const Nodes& nodes = paths_.at(g).nodes;
    if (nodes.size() != count) return false;
    while (k < count && nodes[k] == scripts_.at(g).node(k)) ++k;
  } else {
    const auto entries = trace_.entries(g);
    if (entries.size() != count) return false;
    while (k < count && traced(g, entries, k) == scripts_.at(g).node(k)) ++k;
  }
  if (k == count) agreed_[g] = window_;
  return k == count;
}

template <int D>
bool Subdomain<D>::agrees(double end) {
  const auto until = [&](std::span<const Node<D>> nodes) {
    while (!nodes.empty() && nodes.back().key.time >= end) nodes = nodes.first(nodes.size() - 1);
    return nodes;
  };
  const auto agree = [&](Slot g) {
    if (role_[g] != Role::ghost || agreed_[g] == window_) return true;
    const auto seen = until(path(g)), script = until(script_of(g));
    return std::equal(seen.begin(), seen.end(), script.begin(), script.end());
  };
  return std::ranges::all_of(scripts_.slots(), agree) && std::ranges::all_of(touched_ghosts_, agree) &&
         std::ranges::all_of(paths_.slots(), agree);
}

template <int D>
ContactTally Subdomain<D>::tally() const {
  ContactTally tally;
  for (const auto& event : trace_.events())
    if (const Slot lo = event.slot[0]; is_own(lo) && rewritten_[lo] == 0)
      tally.add(event.slot[1] != kNone ? EventKind::pair : EventKind::wall, event.virial, event.overlap);
  for (const Slot i : paths_.slots()) {
    if (!is_own(i) || rewritten_[i] == 0) continue;
    for (const Node<D>& node : paths_.at(i).nodes)
      if (node.key.lo == node.after.id) tally.add(node.key.kind, node.virial, node.overlap);
  }
  return tally;
}

template <int D>
void Subdomain<D>::cut(const EventKey<D>& last) {
  std::vector<Slot> touched(paths_.slots().begin(), paths_.slots().end());
  for_each_touched([&](Slot i) { touched.push_back(i); });
  for (const Slot i : touched) {
    Nodes& path = rewritten(i).nodes;
    path.erase(std::find_if(path.begin(), path.end(), [&](const Node<D>& n) { return last < n.key; }), path.end());
  }
}

template <int D>
void Subdomain<D>::commit() {
  other_.clear();
  for (const Slot slot : paths_.slots()) {
    if (rewritten_[slot] == 0) continue;
    rewritten_[slot] = 0;
    const Record<D>& now = after(slot);
    const Record<D>& known = core_.flights()[slot];
    if (now.t != known.t || now.x != known.x || now.v != known.v || now.generation != known.generation)
      other_.emplace_back(slot, now), disturbed_[slot] = 1;
  }
  core_.put(other_, end_);
  paths_.clear();
  scripts_.clear();
  changed_.clear();
}

template class Subdomain<2>;
template class Subdomain<3>;

}  // namespace carom
