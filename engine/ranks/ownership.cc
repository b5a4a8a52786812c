// SPDX-License-Identifier: BSD-3-Clause
#include "engine/ranks/ownership.h"

#include <cmath>

namespace carom {

template <int D>
Ownership<D>::Ownership(EventCore<D>& core, const Bisection<D>& bisection, std::uint32_t number,
                        double max_displacement)
    : core_(core),
      bisection_(bisection),
      number_(number),
      max_displacement_(max_displacement),
      from_field_((1 + 1e-6) * core.flights().g().norm() * core.flights().horizon()),
      slots_(core.flights().capacity()),
      role_(core.flights().capacity(), Role::none),
      holders_(core.flights().capacity()) {
  for (Slot i = 0; i < core_.flights().size(); ++i) enlist(i, Role::own);
}

template <int D>
void Ownership<D>::forget(Slot i) {
  role_[i] = Role::none;
  slots_.remove(core_.flights()[i].id);
  core_.dismiss(i);
}

template <int D>
std::vector<Slot> Ownership<D>::own() const {
  std::vector<Slot> own;
  for (Slot i = 0; i < core_.flights().size(); ++i)
    if (owns(i)) own.push_back(i);
  return own;
}

/// Finds the own spheres that may reach the border before the next call.
template <int D>
void Ownership<D>::watch(double now) {
  unwatched_ = 0, number_with_events_ = 0;
  watched_.clear();
  quiet_.clear();
  speed_.clear();
  events_.clear();
  with_events_.resize(role_.size());
  watched_at_.assign(role_.size(), kUnwatched);
  const double until_next = (kWindowsBetweenSearches + 1) * max_displacement_;
  for (Slot i = 0; i < core_.flights().size(); ++i) {
    if (is_ghost(i)) watch_over(i);
    if (!owns(i)) continue;
    const double depth = bisection_.depth(number_, bisection_.wrapped(core_.flights().at(i, now).x));
    if (depth <= reach(i) + until_next) watch_over(i, holders_[i] == 0 ? quiet_at(depth, reach(i)) : 0);
  }
  core_.set_border(watched_, now);
}

/// Finds the owner of a sphere and the subdomains that have it as a ghost, from its present position, and how far it
/// can move before either changes, which is returned. All subdomains that have the sphere find the same.
template <int D>
double Ownership<D>::update_role(Slot i, double now) {
  const Flights<D>& flights = core_.flights();
  const Vec<D> at = bisection_.wrapped(flights.at(i, now).x);
  const double depth = bisection_.depth(number_, at), reach = this->reach(i);
  role_[i] = Role::own;
  holders_[i] = 0;
  if (bisection_.deep(depth, reach)) return quiet_at(depth, reach);
  double quiet;
  if (depth > 0 || bisection_.owner(at) == number_) {
    quiet = depth;
    const auto neighbours = bisection_.neighbours(number_);
    for (std::size_t k = 0; k < neighbours.size(); ++k) {
      const double squared = bisection_.squared_distance(neighbours[k], at);
      if (squared <= reach * reach) holders_[i] |= std::uint64_t{1} << k;
      quiet = std::min(quiet, std::abs(std::sqrt(squared) - reach));
    }
  } else {
    const double squared = bisection_.squared_distance(number_, at), away = std::sqrt(squared);
    if (squared > reach * reach) {
      forget(i);
      return 0;
    }
    role_[i] = Role::ghost;
    quiet = std::min(away, reach - away);
  }
  return quiet - 1e-6 * reach;
}

template <int D>
bool Ownership<D>::admit(const Record<D>& r, double now, const Internal<D>& internal) {
  if (slots_.find(r.id) != IdTable::kNowhere) return true;
  Slot slot = 0;
  if (!core_.admit(r, internal, now, slot)) return false;
  enlist(slot, Role::ghost);
  watch_over(slot);
  return true;
}

template <int D>
bool Ownership<D>::meeting_place(Slot ghost, const Record<D>& r, double end, Vec<D>& low, Vec<D>& high) const {
  const double far = way(r, end);
  const Vec<D> at = bisection_.wrapped(r.x);
  const double close = reach(ghost) - max_displacement_ + far;
  if (bisection_.squared_distance(number_, at) > close * close) return false;
  const double room = reach(ghost) + far;
  low = at - Vec<D>::Constant(room);
  high = at + Vec<D>::Constant(room);
  if (!bisection_.clip(number_, 3 * max_displacement_, low, high)) return false;
  // The part of the ball around the sphere: the farther the region along one axis, the narrower along the others.
  const Vec<D> gap = (low - at).cwiseMax(at - high).cwiseMax(0);
  const double left = room * room - gap.squaredNorm();
  if (left < 0) return false;
  const Vec<D> reach = (gap.cwiseAbs2().array() + left).sqrt();
  low = low.cwiseMax(at - reach).eval();
  high = high.cwiseMin(at + reach).eval();
  low += r.x - at;
  high += r.x - at;
  return true;
}

template <int D>
bool Ownership<D>::may_meet(const Record<D>& r, Slot j, const Offset<D>& offset, double end) const {
  const double close = reach(j) + way(r, end);
  const Record<D>& other = core_.flights()[j];
  const double s = end - other.t;
  if (core_.flights().sheared()) {  // both at the end, because the flow carries them the same way
    const double wide = (1 + 3 * kStrainOfWindow) * close;
    Vec<D> d = core_.flights().at(r, end).x - core_.flights().at(other, end).x + offset.start;
    d[0] += offset.slide * end;
    return d.squaredNorm() <= wide * wide;
  }
  const Vec<D> d = r.x - (other.x + s * other.v + (0.5 * s * s) * core_.flights().g()) + offset.start;
  return d.squaredNorm() <= close * close;
}

template class Ownership<2>;
template class Ownership<3>;

}  // namespace carom
