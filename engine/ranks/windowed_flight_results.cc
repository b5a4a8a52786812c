// What a window has brought, once all subdomains agree about it.

#include <algorithm>

#include "engine/ranks/shared_contacts.h"
#include "engine/ranks/windowed_flight.h"

namespace carom {

/// When a sphere may first have come farther than `max_displacement` in the window; infinite: never.
template <int D>
double WindowedFlight<D>::first_beyond(double end) {
  double speed = 0, first = std::numeric_limits<double>::infinity();
  if (subdomain_) speed = subdomain_->fastest() + g_.norm() * horizon_;
  if (speed > fastest_) subdomain_->for_each_touched([&](Slot i) { first = std::min(first, beyond_at(i, end)); });
  std::array<double, 2> worst{speed, -first};
  ranks_.largest(worst);
  if (worst[0] > fastest_) fastest_ = kFaster * worst[0];
  return -worst[1];
}

/// When a sphere may have come farther than `max_displacement` in the window, by the length of its path; infinite:
/// never.
template <int D>
double WindowedFlight<D>::beyond_at(Slot i, double end) const {
  const auto path = subdomain_->path(i);
  double now = now_, left = max_displacement_;
  for (std::size_t k = 0; k <= path.size(); ++k) {
    const double speed = subdomain_->before(i, k).v.norm() + g_.norm() * horizon_;
    const double until = k < path.size() ? path[k].key.time : end;
    if (speed * (until - now) > left) return now + left / speed;
    left -= speed * (until - now);
    now = until;
  }
  return std::numeric_limits<double>::infinity();
}

/// Removes the events from a time on, and returns it.
template <int D>
double WindowedFlight<D>::cut_at(double time) {
  ++counts_.cut;
  cut_ = true;
  EventKey<D> last{.time = time};
  for (auto& k : last.image) k = std::numeric_limits<std::int32_t>::min();
  if (subdomain_) subdomain_->cut(last);
  return time;
}

/// The contacts of the window.
template <int D>
void WindowedFlight<D>::add_contacts(std::vector<Contact<D>>& contacts) const {
  if (!subdomain_) return;
  subdomain_->for_each_touched([&](Slot i) {
    const auto path = subdomain_->path(i);
    for (std::size_t k = 0; k < path.size(); ++k)
      if (path[k].key.lo == path[k].after.id) contacts.push_back(contact_of(i, k));
  });
}

/// Adds up what all ranks have to report of a run.
template <int D>
void WindowedFlight<D>::report_all(const ContactTally& sum, const std::vector<Contact<D>>& contacts,
                                   const Report& report) {
  const ContactTally all = sum_of_all(ranks_, sum);
  report.counters.add(all);
  if (report.contacts) merge_contacts<D>(gather_on_first(ranks_, packed<D>(contacts)), *report.contacts);
}

/// The contact that node k of a path stands for.
template <int D>
Contact<D> WindowedFlight<D>::contact_of(Slot lo, std::size_t k) const {
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

/// The key of the n-th pair collision of the window.
template <int D>
std::optional<EventKey<D>> WindowedFlight<D>::key_of_collision(std::uint64_t number) const {
  Bytes mine;
  if (subdomain_)
    subdomain_->for_each_touched([&](Slot i) {
      for (const Node<D>& node : subdomain_->path(i))
        if (node.key.kind == EventKind::pair && node.key.lo == node.after.id) put(mine, node.key);
    });
  std::vector<EventKey<D>> keys;
  for (const Bytes& bytes : ranks_.gather(mine))
    for (Reader reader(bytes); reader.more();) keys.push_back(reader.get<EventKey<D>>());
  if (number == 0 || number > keys.size()) return std::nullopt;
  std::nth_element(keys.begin(), keys.begin() + static_cast<std::ptrdiff_t>(number - 1), keys.end());
  return keys[number - 1];
}

template double WindowedFlight<2>::first_beyond(double);
template double WindowedFlight<2>::cut_at(double);
template void WindowedFlight<2>::add_contacts(std::vector<Contact<2>>&) const;
template void WindowedFlight<2>::report_all(const ContactTally&, const std::vector<Contact<2>>&, const Report&);
template std::optional<EventKey<2>> WindowedFlight<2>::key_of_collision(std::uint64_t) const;
template double WindowedFlight<3>::first_beyond(double);
template double WindowedFlight<3>::cut_at(double);
template void WindowedFlight<3>::add_contacts(std::vector<Contact<3>>&) const;
template void WindowedFlight<3>::report_all(const ContactTally&, const std::vector<Contact<3>>&, const Report&);
template std::optional<EventKey<3>> WindowedFlight<3>::key_of_collision(std::uint64_t) const;

}  // namespace carom
