// SPDX-License-Identifier: BSD-3-Clause
#include "engine/ranks/subdomain.h"

#include <algorithm>

namespace carom {

template <int D>
void Subdomain<D>::load(std::vector<Record<D>> records, const Bisection<D>& bisection, std::uint32_t number,
                        const Vec<D>& g, double horizon, double now, double max_displacement,
                        const std::vector<Spin<D>>& spins) {
  release();
  core_.load(std::move(records), g, horizon, now, 2 * max_displacement, spins);
  const std::size_t slots = core_.flights().capacity();
  ownership_.emplace(core_);
  paths_.emplace(core_.flights(), *ownership_);
  repair_.emplace(box_, core_, *ownership_, *paths_);
  ownership_->load(bisection, number, max_displacement);
  paths_->load(slots);
  repair_->load(slots);
  changed_.clear();
}

template <int D>
void Subdomain<D>::release() {
  redone_events_ = redone_events();
  repair_.reset();
  paths_.reset();
  ownership_.reset();
  core_.release();
}

template <int D>
double Subdomain<D>::run(double now, double end) {
  end_ = end;
  length_ = end - now;
  redone_before_ = redone_events();
  repair_->start(end);
  Counters unused;
  double reached = end;
  try {
    core_.run(end, {.counters = unused, .trace = &paths_->start()});
  } catch (LogFull) {
    reached = core_.now();
  }
  run_events_ += paths_->trace().events().size();
  changed_ = paths_->end();
  return reached;
}

template <int D>
void Subdomain<D>::commit() {
  const auto other = paths_->finish();
  for (const auto& each : other) ownership_->turn(each.slot, true);
  core_.put(other, end_);
  changed_.clear();
}

template <int D>
Contact<D> Subdomain<D>::contact_of(Slot lo, std::size_t k) {
  const EventKey<D> key = paths_->path(lo)[k].key;
  Record<D> a = paths_->before(lo, k);
  Spin<D> spin_a = paths_->spin_before(lo, k);
  if (key.kind == EventKind::wall) {
    const Impact<D> impact = flights().bounce(lo, a, &spin_a, box_.wall(key.hi), key.time, key.generation);
    return flights().contact_of(key, a, impact);
  }
  const Slot hi = ownership_->slot_of(key.hi);
  const auto nodes = paths_->path(hi);
  const auto met = std::ranges::find(nodes, key, &Node<D>::key) - nodes.begin();
  Record<D> b = paths_->before(hi, static_cast<std::size_t>(met));
  Spin<D> spin_b = paths_->spin_before(hi, static_cast<std::size_t>(met));
  const Vec<D> shift = box_.shift(key.image);
  const Impact<D> impact = flights().collide(lo, a, &spin_a, hi, b, &spin_b, shift, key.time, key.generation);
  return flights().contact_of(key, a, b, shift, impact);
}

template class Subdomain<2>;
template class Subdomain<3>;

}  // namespace carom
