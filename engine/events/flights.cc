// SPDX-License-Identifier: BSD-3-Clause
#include "engine/events/flights.h"

#include <algorithm>
#include <string>

#include "engine/base/error.h"
#include "engine/events/meeting.h"
#include "engine/events/step_event.h"

namespace carom {
namespace {

/// The common value, or 0 if the values differ.
double common(const std::vector<double>& values) {
  const bool equal = std::all_of(values.begin(), values.end(), [&](double v) { return v == values[0]; });
  return equal && !values.empty() ? values[0] : 0;
}

}  // namespace

template <int D>
void Flights<D>::assign(std::span<const Id> order) {
  records_.resize(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) records_[i].id = order[i];
  capacity_ = order.size();
  packing_ = Packing<D>(capacity_, capacity_);
}

template <int D>
void Flights<D>::load(const Particles<D>& particles, const Vec<D>& g, double horizon, double growth) {
  set_surroundings();
  g_ = g;
  field_ = g != Vec<D>::Zero();
  growth_ = growth;
  has_internal_ = laws().need_internal();
  has_steps_ = !box_.steps.empty() && growth_ == 0;
  horizon_ = horizon;
  common_radius_ = common(particles.radius);
  common_mass_ = common(particles.mass);
  radius_.clear();
  mass_.clear();
  for (Record<D>& r : records_) {
    if (common_radius_ == 0) radius_.push_back(particles.radius[r.id]);
    if (common_mass_ == 0) mass_.push_back(particles.mass[r.id]);
    r = {particles.x[r.id], particles.v[r.id], 0.0, r.id, 0, particles.species[r.id]};
  }
  set_surfaces();
  internal_.clear();
  if (has_internal_)
    for (const Record<D>& r : records_) internal_.push_back(particles.internal(r.id));
}

template <int D>
void Flights<D>::set_surroundings() {
  walls_ = box_.walls();
  kicks_ = box_.bath.kicks();
  lone_events_ = kicks_ || !walls_.empty();
  sheared_ = box_.sheared();
}

/// The kernels know steps that all pairs have at the same distances, on straight flights.
template <int D>
void Flights<D>::set_surfaces() {
  surfaces_.clear();
  const PairSteps* const steps = has_steps_ && equal() && !field_ && !sheared_ ? box_.steps.of_all() : nullptr;
  if (!steps) return;
  const double sigma = common_radius_ + common_radius_, widest = std::max(kJustMet * sigma, gap_tolerance_(0));
  const auto add = [&](double distance) {  // with twice the margin of any pair in next_step_time()
    const double squared = distance * distance;
    surfaces_.push_back({distance, squared, 2 * (kNearStep * squared + 4 * widest * distance)});
  };
  add(steps->core_distance(sigma));
  for (const StepSurface& each : steps->surfaces) add(each.distance(sigma));
}

template <int D>
std::vector<double> Flights<D>::reaches(double t) const {
  std::vector<double> all = radius_.empty() ? std::vector<double>{common_radius_} : radius_;
  for (double& r : all) r = grown(r, t);
  return growth_ == 0 ? box_.steps.reach()(std::move(all)) : all;
}

template <int D>
Extent<D> Flights<D>::extent() const {
  Extent<D> all;
  for (const Record<D>& r : records_) all.add(r.x);
  return all;
}

template <int D>
ScanSetting Flights<D>::setting() const {
  ScanSetting setting{.records = reinterpret_cast<const double*>(records_.data()),
                      .radius = radius_.empty() ? nullptr : radius_.data(),
                      .diameter = common_radius_ + common_radius_,
                      .growth = growth_,
                      .slot_mask = packing_.slot_mask,
                      .slot_bits = packing_.slot_bits,
                      .field_bits = packing_.field_bits,
                      .plain = radius_.empty() && !field_ && growth_ == 0 && !sheared_,
                      .sheared = radius_.empty() && !field_ && growth_ == 0 && sheared_,
                      .tilt = sheared_ ? box_.tilt : 0,
                      .slide = sheared_ ? box_.slide() : 0,
                      .surfaces = surfaces_.empty() ? nullptr : surfaces_.data(),
                      .surface_count = static_cast<unsigned>(surfaces_.size())};
  for (int k = 0; k < D; ++k) {
    setting.edges[k] = box_.edges[k];
    setting.g[k] = g_[k];
  }
  return setting;
}

template <int D>
void Flights<D>::load(std::span<const Record<D>> records, const Sizes& sizes, const Vec<D>& g, double horizon,
                      std::span<const Internal<D>> internal, std::span<const std::uint32_t> order) {
  set_surroundings();
  g_ = g;
  field_ = g != Vec<D>::Zero();
  growth_ = 0;
  has_internal_ = laws().need_internal();
  has_steps_ = !box_.steps.empty();
  horizon_ = horizon;
  common_radius_ = common(sizes.radius);
  common_mass_ = common(sizes.mass);
  set_surfaces();
  capacity_ = records_room(records.size());
  packing_ = Packing<D>(capacity_, sizes.spheres);
  records_.clear();
  records_.reserve(capacity_);
  radius_.clear();
  mass_.clear();
  internal_.clear();
  for (Slot i = 0; i < records.size(); ++i) {
    const std::size_t from = order.empty() ? i : order[i];
    const Record<D>& r = records[from];
    admit(i, r, sizes.radius_of(r), sizes.mass_of(r), internal.empty() ? Internal<D>{} : internal[from]);
  }
}

template <int D>
void Flights<D>::admit(Slot i, const Record<D>& r, double radius, double mass, const Internal<D>& internal) {
  if (i == records_.size()) {
    records_.push_back(r);
    if (common_radius_ == 0) radius_.push_back(radius);
    if (common_mass_ == 0) mass_.push_back(mass);
    if (has_internal_) internal_.push_back(internal);
    return;
  }
  set(i, r, internal);
  if (common_radius_ == 0) radius_[i] = radius;
  if (common_mass_ == 0) mass_[i] = mass;
}

template <int D>
double Flights<D>::pair_contact(Slot i, const Record<D>& a, Slot j, const Record<D>& b, const Offset<D>& offset) const {
  const double now = std::max(a.t, b.t);
  const double s_a = now - a.t, s_b = now - b.t;
  Vec<D> d = (a.x + s_a * a.v) - (b.x + s_b * b.v);
  Vec<D> v = a.v - b.v;
  if (field_) {
    d += (0.5 * (s_a * s_a - s_b * s_b)) * g_;
    v += (s_a - s_b) * g_;
  }
  d += offset.start;
  if (sheared_) [[unlikely]] {
    d[0] += offset.slide * now;
    v[0] += offset.slide;
  }
  const double radii = radius(i) + radius(j), sigma = grown(radii, now), rate = radii * growth_;
  if (const PairSteps* const steps = steps_of(a, b)) [[unlikely]]
    return now + next_step_time<D>(*steps, d, v, sigma,
                                   side_tolerance(just_met(a, b), a.t == 0 && b.t == 0, sigma, gap_tolerance_(0)),
                                   [&] { return approach_slack(sigma, a.v.norm(), b.v.norm()); });
  const bool apart = d.squaredNorm() > sigma * sigma;
  const double slack = apart ? 0 : approach_slack(sigma, a.v.norm(), b.v.norm() + rate + std::abs(offset.slide));
  return now + contact_time<D>(d, v, sigma, rate, slack);
}

template <int D>
double Flights<D>::wall_contact(Slot i, const Record<D>& r, const Wall<D>& wall) const {
  if (is_fixed(mass(i))) return kNever;
  const double at_record = grown(radius(i), r.t), rate = radius(i) * growth_;
  const double slack = approach_slack(1.0, r.v.norm(), rate + std::abs(wall.velocity_at(r.t)));
  const double s = wall_meeting<D>(wall, r.x, r.v, g_, at_record, rate, r.t, horizon_ - r.t, gap_tolerance_(at_record),
                                   [&] { return slack; });
  if (!std::isfinite(slack))
    throw Error(Failure::numerical, "the speed of particle " + std::to_string(r.id) +
                                        " is too large: its square is no number; give smaller velocities, "
                                        "temperatures and accelerations");
  const bool approaches = s == 0 && wall.at(r.x).opening(r.v, r.t) - rate < -slack;
  if (s == 0 && !approaches && !wall.thermal())
    throw Error(Failure::numerical,
                "particle " + std::to_string(r.id) + " rests or slides on " + box_.wall_name(wall.number) +
                    " and would bounce without end in free flight; take edda, which holds it, or give it a height or "
                    "a velocity away from the wall");
  return r.t + s;
}

template <int D>
template <bool kInternal>
[[gnu::always_inline]] inline EventResult<D> Flights<D>::collide_with(Slot i, Record<D>& a, Internal<D>* in_a, Slot j,
                                                                      Record<D>& b, Internal<D>* in_b,
                                                                      const Offset<D>& offset, double t,
                                                                      std::uint32_t generation) const {
  advance(a, t);
  advance(b, t);
  const Vec<D> d = separation(a, b, offset);
  const double radii = radius(i) + radius(j), sigma = grown(radii, t);
  const Partner<D> of_a{mass(i), radius(i), a.species, in_a}, of_b{mass(j), radius(j), b.species, in_b};
  const Vec<D> v = relative_velocity(a, b, offset);
  const double w = radii * growth_;
  const PairImpulse<D> met = kInternal ? pair_impulse<D>(laws(), d, v, of_a, of_b, sigma, w)
                                       : normal_impulse<D>(laws(), d, v, of_a, of_b, sigma, w);
  const Vec<D> impulse = met.on_first(d);
  if (common_mass_ == 1) {  // gives the same bits without divisions
    a.v += impulse;
    b.v -= impulse;
  } else {
    a.v += impulse / of_a.mass;
    b.v -= impulse / of_b.mass;
  }
  a.generation = b.generation = static_cast<std::uint16_t>(generation);
  EventResult<D> result{
      d, impulse, {.virial = d.dot(impulse), .dissipated = met.dissipated}, 1 - d.norm() / sigma, sigma};
  if (sheared_) [[unlikely]]
    result.exchange.shear = -offset.slide * impulse[0];
  return result;
}

template <int D>
EventResult<D> Flights<D>::collide_smooth(Slot i, Record<D>& a, Slot j, Record<D>& b, const Offset<D>& offset, double t,
                                          std::uint32_t generation) const {
  return collide_with<false>(i, a, nullptr, j, b, nullptr, offset, t, generation);
}

template <int D>
EventResult<D> Flights<D>::collide(Slot i, Record<D>& a, Internal<D>& in_a, Slot j, Record<D>& b, Internal<D>& in_b,
                                   const Offset<D>& offset, double t, std::uint32_t generation) const {
  const PairSteps* const steps = steps_of(a, b);
  if (steps) [[unlikely]] {
    advance(a, t);
    advance(b, t);
    const Vec<D> d = separation(a, b, offset);
    if (const StepSurface* const step = step_at(*steps, d.norm(), contact_distance(i, j)))
      return meet_step(*step, i, a, j, b, d, generation);
  }
  EventResult<D> result = has_internal_ ? collide_with<true>(i, a, &in_a, j, b, &in_b, offset, t, generation)
                                        : collide_smooth(i, a, j, b, offset, t, generation);
  if (steps) [[unlikely]] {
    result.sigma = steps->core_distance(result.sigma);
    result.overlap = 1 - result.d.norm() / result.sigma;
  }
  return result;
}

template <int D>
EventResult<D> Flights<D>::meet_step(const StepSurface& step, Slot i, Record<D>& a, Slot j, Record<D>& b,
                                     const Vec<D>& d, std::uint32_t generation) const {
  const Vec<D> v = a.v - b.v;
  const double sigma = contact_distance(i, j);
  const PairImpulse<D> met = step_impulse<D>(step, laws(), d, v, {mass(i), radius(i), a.species, nullptr},
                                             {mass(j), radius(j), b.species, nullptr});
  met.apply(d, mass(i), a.v, mass(j), b.v);
  a.generation = b.generation = static_cast<std::uint16_t>(generation);
  const double range = step.distance(sigma);
  const Vec<D> impulse = met.on_first(d);
  return {d,
          impulse,
          {.virial = d.dot(impulse), .dissipated = met.dissipated, .stored = met.stored, .event = met.event},
          step.tether() ? d.norm() / range - 1 : 0,
          range};
}

template <int D>
double Flights<D>::next_kick(Slot i, const Record<D>& r) const {
  return is_fixed(mass(i)) ? kNever : box_.bath.next_kick(r.id, box_.time, r.t, horizon_);
}

template <int D>
EventResult<D> Flights<D>::meet_alone(const EventKey<D>& key, Slot i, Record<D>& r, Internal<D>* internal) const {
  const double t = key.time, at_contact = grown(radius(i), t), m = mass(i);
  const Draw draw{.id = r.id, .time = box_.time + t, .number = key.generation};
  advance(r, t);
  r.generation = static_cast<std::uint16_t>(key.generation);
  const Vec<D> flow = this->flow(r), before = r.v - flow;
  const auto shear = [&](const Vec<D>& impulse) { return flow[0] * impulse[0]; };
  if (key.kind == EventKind::kick) {
    const Vec<D> after = kicked_velocity<D>(box_.bath, m, draw), impulse = m * (after - before);
    r.v = after;
    if (sheared_) r.v += flow;
    const double heat = 0.5 * m * (after.squaredNorm() - before.squaredNorm());
    return {Vec<D>::Zero(), impulse, {.heat = heat, .shear = shear(impulse)}, 0, at_contact};
  }
  const Wall<D> wall = box_.wall(key.hi);
  auto [after, impulse, exchange] =
      wall_impulse<D>(laws(), wall.at(r.x), before, {m, at_contact, r.species, has_internal_ ? internal : nullptr},
                      draw, t, radius(i) * growth_);
  r.v = after;
  if (sheared_) r.v += flow;
  exchange.shear = shear(impulse);
  return {r.x - wall.foot(r.x, t), impulse, exchange, -wall.gap(r.x, at_contact, t) / at_contact, at_contact};
}

template <int D>
Contact<D> Flights<D>::contact_of(const EventKey<D>& key, const Record<D>& a, const Record<D>& b,
                                  const Offset<D>& offset, const EventResult<D>& result) const {
  const auto& [d, impulse, exchange, overlap, sigma] = result;
  const Vec<D> shift = offset.at(key.time), v_a = a.v - flow(a), v_b = b.v - flow(b);
  if (a.id < b.id) return {key, a.x, b.x - shift, impulse, exchange, overlap, sigma, v_a, v_b};
  return {key, b.x, a.x + shift, -impulse, exchange, overlap, sigma, v_b, v_a};
}

template <int D>
Contact<D> Flights<D>::contact_of(const EventKey<D>& key, const Record<D>& r, const EventResult<D>& result) const {
  const auto& [d, impulse, exchange, overlap, sigma] = result;
  const Vec<D> touched = key.kind == EventKind::wall ? box_.wall(key.hi).foot(r.x, key.time) : r.x;
  return {key, r.x, touched, impulse, exchange, overlap, sigma, r.v - flow(r)};
}

template class Flights<2>;
template class Flights<3>;

}  // namespace carom
