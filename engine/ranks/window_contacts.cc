#include "engine/ranks/window_contacts.h"

#include <algorithm>

namespace carom {

template <int D>
template <class Visit>
void WindowContacts<D>::for_each(Visit&& visit) const {
  if (!subdomain_) return;
  subdomain_->for_each_touched([&](Slot i) {
    const auto path = subdomain_->path(i);
    for (std::size_t k = 0; k < path.size(); ++k)
      if (path[k].key.lo == path[k].after.id) visit(i, k);
  });
}

template <int D>
void WindowContacts<D>::append_to(std::vector<Contact<D>>& contacts) const {
  for_each([&](Slot i, std::size_t k) { contacts.push_back(contact_of(i, k)); });
}

template <int D>
std::optional<EventKey<D>> WindowContacts<D>::key_of_collision(std::uint64_t number, Communicator& ranks) const {
  Bytes mine;
  for_each([&](Slot i, std::size_t k) {
    if (const EventKey<D>& key = subdomain_->path(i)[k].key; key.kind == EventKind::pair) put(mine, key);
  });
  std::vector<EventKey<D>> keys;
  for (const Bytes& bytes : ranks.gather(mine))
    for (Reader reader(bytes); reader.more();) keys.push_back(reader.get<EventKey<D>>());
  if (number == 0 || number > keys.size()) return std::nullopt;
  std::nth_element(keys.begin(), keys.begin() + static_cast<std::ptrdiff_t>(number - 1), keys.end());
  return keys[number - 1];
}

/// The contact that node k of a path stands for.
template <int D>
Contact<D> WindowContacts<D>::contact_of(Slot lo, std::size_t k) const {
  const EventKey<D> key = subdomain_->path(lo)[k].key;
  const Flights<D>& flights = subdomain_->flights();
  Record<D> a = subdomain_->before(lo, k);
  if (key.kind == EventKind::wall) {
    const Blow<D> blow = flights.bounce(lo, a, box_.wall(key.hi), key.time, key.generation);
    return flights.contact_of(key, a, blow);
  }
  const Slot hi = subdomain_->slot_of(key.hi);
  const auto path = subdomain_->path(hi);
  const auto met = std::ranges::find(path, key, &Node<D>::key) - path.begin();
  Record<D> b = subdomain_->before(hi, static_cast<std::size_t>(met));
  const Vec<D> shift = box_.shift(key.image);
  const Blow<D> blow = flights.collide(lo, a, hi, b, shift, key.time, key.generation);
  return flights.contact_of(key, a, b, shift, blow);
}

template class WindowContacts<2>;
template class WindowContacts<3>;

}  // namespace carom
