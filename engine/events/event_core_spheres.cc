// The spheres of a core: loading, admitting and dismissing them, and planning at the start of a slab.

#include "engine/events/contact.h"
#include "engine/events/event_core.h"

namespace carom {
namespace {

/// Interleaves the bits of D numbers: places near on this curve are near in space (Morton).
template <int D>
std::uint64_t interleave(const std::array<std::uint32_t, D>& place) {
  std::uint64_t code = 0;
  for (int bit = 20; bit >= 0; --bit)
    for (int k = 0; k < D; ++k) code = code << 1 | (place[k] >> bit & 1);
  return code;
}

/// The numbers of n places x(i) in the order of a space-filling curve.
template <int D, class Place>
std::vector<std::uint32_t> along_curve(std::size_t n, Place&& x) {
  std::vector<std::uint32_t> order(n);
  if (n == 0) return order;
  Vec<D> low = x(0), high = low;
  for (std::size_t i = 0; i < n; ++i) low = low.cwiseMin(x(i)).eval(), high = high.cwiseMax(x(i)).eval();
  const double scale = ((1 << 20) - 1) / std::max((high - low).maxCoeff(), 1e-300);
  std::vector<std::pair<std::uint64_t, std::uint32_t>> places(n);
  for (std::size_t i = 0; i < n; ++i) {
    std::array<std::uint32_t, D> place;
    for (int k = 0; k < D; ++k) place[k] = static_cast<std::uint32_t>((x(i)[k] - low[k]) * scale);
    places[i] = {interleave<D>(place), static_cast<std::uint32_t>(i)};
  }
  std::sort(places.begin(), places.end());
  for (std::size_t i = 0; i < n; ++i) order[i] = places[i].second;
  return order;
}

}  // namespace

template <int D>
void EventCore<D>::load(const Particles<D>& particles, const Vec<D>& g, double horizon, double growth) {
  plan(read(particles, g, horizon, growth), 0);
}

template <int D>
void EventCore<D>::load(std::vector<Record<D>> records, const Vec<D>& g, double horizon, double now,
                        double max_displacement) {
  const auto order = along_curve<D>(records.size(), [&](std::size_t i) -> const Vec<D>& { return records[i].x; });
  std::vector<Record<D>> sorted(records.size());
  for (std::size_t i = 0; i < records.size(); ++i) sorted[i] = records[order[i]];
  std::vector<Record<D>>().swap(records);
  max_displacement_ = max_displacement;
  at_border_.clear();
  events_ = since_sort_ = 0;
  now_ = now;
  tied_ = {};
  free_.clear();
  lists_.reset();
  flights_.load(sorted, *sizes_, g, horizon);
  plan(true, now);
}

template <int D>
void EventCore<D>::take(Particles<D>& particles, const Vec<D>& g, double horizon, double growth) {
  const bool anew = read(particles, g, horizon, growth);
  std::vector<Vec<D>>().swap(particles.x);
  std::vector<Vec<D>>().swap(particles.v);
  plan(anew, 0);
}

template <int D>
void EventCore<D>::give_back(double time, Particles<D>& particles) {
  calendar_ = Calendar();  // makes room
  fly_to(time, particles);
}

/// Takes over the records; returns whether the slots have changed.
template <int D>
bool EventCore<D>::read(const Particles<D>& particles, const Vec<D>& g, double horizon, double growth) {
  const std::size_t n = particles.size();
  events_ = 0;
  now_ = 0;
  tied_ = {};
  const bool anew =
      flights_.size() != n || static_cast<double>(since_sort_) > options_.sort_interval * static_cast<double>(n);
  if (anew) {
    lists_.reset();
    free_.clear();
    flights_.assign(along_curve<D>(n, [&](std::size_t i) -> const Vec<D>& { return particles.x[i]; }));
    since_sort_ = 0;
  }
  flights_.load(particles, g, horizon, growth);
  return anew;
}

/// Plans the first event of every sphere.
template <int D>
void EventCore<D>::plan(bool anew, double now) {
  const std::size_t n = flights_.size();
  packing_ = Packing<D>(flights_.room());
  small_ = 8 * static_cast<double>(flights_.room()) <= options_.in_cache;
  large_ = static_cast<double>(flights_.room()) > options_.in_cache;
  setting_ = flights_.setting(packing_);
  std::vector<double> radii = flights_.radii(flights_.horizon());
  if (lists_ && !anew && radii_ == radii) {  // lists outlive a slab while they are good for its radii
    lists_->follow(flights_.records());
    for (auto& a : next_events_) a.version = 0;
  } else {
    next_events_.clear();
    next_events_.reserve(flights_.room());
    next_events_.assign(n, NextEvent<D>{});
    radii_ = std::move(radii);
    choose_search(now);
  }
  for (std::size_t i = 0; i < n; ++i) foresee(static_cast<Slot>(i), now), settle();
  constexpr std::size_t kSample = 8192;
  std::vector<double> some;
  for (std::size_t i = 0; i < n; i += n / kSample + 1) some.push_back(next_events_[i].due());
  calendar_.reset(flights_.horizon(), n, options_.entries_per_bin, std::move(some), now);
  for (std::size_t i = 0; i < n; ++i) schedule(static_cast<Slot>(i));
}

template <int D>
void EventCore<D>::choose_search(double now) {
  // The density is that of the whole system: a subdomain has a part of it, or no spheres yet; larger ones may come.
  const std::vector<double>& radii = flights_.size() == 0 && sizes_ ? sizes_->radius : radii_;
  if (counts_.predictions == 0) tuning_ = SearchTuning(options_);
  Extent<D> extent = flights_.extent();
  if (sizes_) {
    largest_ = sizes_->largest_radius();
    extent.particles = sizes_->spheres;
  } else {
    largest_ = *std::max_element(radii.begin(), radii.end());
  }
  SearchSituation situation = situation_of<D>(box_, radii, extent);
  situation.largest = 2 * largest_;
  tuning_.choose(situation, counts_);
  if (!tuning_.lists()) {
    lists_.reset();
    cells_ = std::make_unique<LinkedCells<D>>(box_, packing_, kernels_, tuning_.cell(), extent, flights_.size());
    if (flights_.size() < extent.particles) cells_->confine(flights_.places(now));
    for (Slot i = 0; i < flights_.size(); ++i) {
      next_events_[i].where.cell = cells_->place(flights_.at(i, now).x);
      cells_->insert(i, next_events_[i].where.cell);
    }
    return;
  }
  cells_.reset();
  double skin = tuning_.skin();
  for (int k = 0; k < D; ++k)
    if (box_.periodic(k)) skin = std::min(skin, 0.2 * box_.edges[k]);  // less than half a box: images stay clear
  lists_ =
      std::make_unique<SkinLists<D>>(box_, packing_, kernels_, radii_, flights_.equal(), largest_, skin, next_events_);
  lists_->build(
      flights_.size(), [&](Slot i) { return flights_.at(i, now).x; }, extent, max_displacement_);
}

template <int D>
bool EventCore<D>::admit(const Record<D>& r, double now, Slot& slot) {
  if (!free_.empty()) {
    slot = free_.back();
    free_.pop_back();
  } else {
    if (flights_.size() == flights_.room()) return false;
    slot = static_cast<Slot>(flights_.size());
  }
  const double radius = sizes_->radius_of(r);
  flights_.admit(slot, r, radius, sizes_->mass_of(r));
  if (slot == next_events_.size()) {
    next_events_.emplace_back();
    if (!flights_.equal()) radii_.push_back(radius);
  } else if (!flights_.equal()) {
    radii_[slot] = radius;
  }
  ++next_events_[slot].version;
  setting_ = flights_.setting(packing_);
  const Vec<D> x = flights_.at(slot, now).x;
  if (!at_border_.empty()) at_border_[slot] = lists_ && lists_->skin() >= 3 * max_displacement_ ? 1 : 0;
  if (lists_) {
    lists_->admit(slot, x, radii_);
  } else {
    next_events_[slot].where.cell = cells_->place(x);
    cells_->admit(slot, next_events_[slot].where.cell);
  }
  predict(slot, now), settle();
  return true;
}

template <int D>
void EventCore<D>::dismiss(Slot i) {
  NextEvent<D>& a = next_events_[i];
  ++a.version;  // contacts planned with it are stale
  a.contact = a.update = kNever;
  if (lists_)
    lists_->dismiss(i);
  else
    cells_->remove(i, a.where.cell);
  free_.push_back(i);
}

template <int D>
void EventCore<D>::put(std::span<const std::pair<Slot, Record<D>>> records, double now) {
  for (const auto& [i, r] : records) {
    flights_.set(i, r);
    ++next_events_[i].version;
  }
  for (const auto& [i, r] : records) {
    const Vec<D> x = flights_.at(i, now).x;
    if (lists_) {
      lists_->move(i, x, room(i));
    } else {
      CellPlace<D>& cell = next_events_[i].where.cell;
      cells_->remove(i, cell);
      cell = cells_->place(x);
      cells_->admit(i, cell);
    }
  }
  for (const auto& [i, r] : records) predict(i, now), settle();
}

template <int D>
std::span<const std::uint32_t> EventCore<D>::find_near(Slot i) {
  if (lists_) return lists_->find_near(i, max_displacement_);
  cells_->find_near(next_events_[i].where.cell, 2 * (largest_ + max_displacement_), near_);
  return near_;
}

template <int D>
std::span<const std::uint32_t> EventCore<D>::find_near_at_border(Slot i, const Vec<D>& low, const Vec<D>& high) {
  if (!lists_) {
    cells_->find_between(low, high, near_);
    return near_;
  }
  if (room(i) == lists_->skin()) return find_near(i);
  return {lists_->candidates(next_events_[i]), next_events_[i].count};
}

template <int D>
void EventCore<D>::set_border(std::span<const Slot> slots, double now) {
  at_border_.assign(flights_.room(), 0);
  if (!lists_ || lists_->skin() < 3 * max_displacement_) return;
  for (const Slot i : slots) {
    at_border_[i] = 1;
    if (lists_->move(i, flights_.at(i, now).x, room(i)))
      predict(i, now), settle();
    else
      predict_update(i, now), schedule(i);
  }
}

template void EventCore<2>::load(const Particles<2>&, const Vec<2>&, double, double);
template void EventCore<2>::load(std::vector<Record<2>>, const Vec<2>&, double, double, double);
template void EventCore<2>::take(Particles<2>&, const Vec<2>&, double, double);
template void EventCore<2>::give_back(double, Particles<2>&);
template bool EventCore<2>::admit(const Record<2>&, double, Slot&);
template void EventCore<2>::dismiss(Slot);
template void EventCore<2>::put(std::span<const std::pair<Slot, Record<2>>>, double);
template void EventCore<2>::set_border(std::span<const Slot>, double);
template std::span<const std::uint32_t> EventCore<2>::find_near(Slot);
template std::span<const std::uint32_t> EventCore<2>::find_near_at_border(Slot, const Vec<2>&, const Vec<2>&);
template void EventCore<3>::load(const Particles<3>&, const Vec<3>&, double, double);
template void EventCore<3>::load(std::vector<Record<3>>, const Vec<3>&, double, double, double);
template void EventCore<3>::take(Particles<3>&, const Vec<3>&, double, double);
template void EventCore<3>::give_back(double, Particles<3>&);
template bool EventCore<3>::admit(const Record<3>&, double, Slot&);
template void EventCore<3>::dismiss(Slot);
template void EventCore<3>::put(std::span<const std::pair<Slot, Record<3>>>, double);
template void EventCore<3>::set_border(std::span<const Slot>, double);
template std::span<const std::uint32_t> EventCore<3>::find_near(Slot);
template std::span<const std::uint32_t> EventCore<3>::find_near_at_border(Slot, const Vec<3>&, const Vec<3>&);

}  // namespace carom
