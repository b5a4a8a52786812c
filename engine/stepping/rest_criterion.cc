// SPDX-License-Identifier: BSD-3-Clause
#include "engine/stepping/rest_criterion.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace carom {

template <int D>
void RestCriterion<D>::begin_step(const std::vector<Vec<D>>* a, double length) {
  a_ = a;
  length_ = length;
  fallen_back_.clear();
  note_reactions();
}

template <int D>
void RestCriterion<D>::note_reactions() {
  pressed_.assign(reactions_.empty() ? 0 : particles_.size(), 0.0);
  held_.assign(box_.contacts.elastic() ? 0 : pressed_.size(), Vec<D>::Zero());
  for (const auto& [key, force] : reactions_) {
    pressed_[key.lo] += force / particles_.mass[key.lo];
    if (key.kind == EventKind::pair) pressed_[key.hi] += force / particles_.mass[key.hi];
    if (held_.empty()) continue;
    const Vec<D> along = contact_normal<D>(box_, particles_, key, particles_.x).normalized();
    held_[key.lo] += force / particles_.mass[key.lo] * along;
    if (key.kind == EventKind::pair) held_[key.hi] -= force / particles_.mass[key.hi] * along;
  }
}

template <int D>
double RestCriterion<D>::known_force(const EventKey<D>& key) const {
  const EventKey<D> wanted = without_time(key);
  const auto known = std::ranges::lower_bound(reactions_, wanted, {}, &Reaction<D>::key);
  return known != reactions_.end() && known->key == wanted ? known->force : 0.0;
}

template <int D>
bool RestCriterion<D>::dissipates(const EventKey<D>& key) const {
  if (box_.contacts.elastic() || law_of(key).elastic()) return false;
  return key.kind == EventKind::pair || box_.options.empty() || !box_.wall(key.hi).thermal();
}

template <int D>
const ContactLaw& RestCriterion<D>::law_of(const EventKey<D>& key) const {
  const auto& species = particles_.species;
  return key.kind == EventKind::pair ? box_.contacts.of_pair(species[key.lo], species[key.hi])
                                     : box_.contacts.of_wall(species[key.lo], key.hi);
}

/// The acceleration at which forces, without reactions, open a contact.
template <int D>
double RestCriterion<D>::opening_by_forces(const EventKey<D>& key, const Vec<D>& normal) const {
  const bool pair = key.kind == EventKind::pair;
  Vec<D> a = Vec<D>::Zero();
  if (a_ && key.lo < a_->size()) a = pair ? Vec<D>((*a_)[key.lo] - (*a_)[key.hi]) : (*a_)[key.lo];
  if (!pair && !box_.options.empty()) a -= box_.wall(key.hi).acceleration * normal;
  return a.dot(normal) / normal.norm();
}

/// The acceleration at which a contact would close by forces and, if contacts dissipate, by other reactions.
template <int D>
double RestCriterion<D>::pressing(const EventKey<D>& key, const Vec<D>& normal, double force) const {
  const bool pair = key.kind == EventKind::pair;
  const double opening = opening_by_forces(key, normal);
  double closing = std::max(force * inverse_mass(key), -opening);
  if (!fallen_back_.empty())
    for (const auto& [partners, acceleration] : fallen_back_)
      if (partners == without_time(key)) closing = std::max(closing, acceleration);
  if (held_.empty()) return closing;
  const Vec<D> by_others = pair ? Vec<D>(held_[key.lo] - held_[key.hi]) : held_[key.lo];
  return std::max(closing, -opening - by_others.dot(normal) / normal.norm());
}

template <int D>
double RestCriterion<D>::rest_speed(const EventKey<D>& key, const Vec<D>& normal) const {
  if (!dissipates(key)) return 0;
  const ContactLaw& law = law_of(key);
  const double slowest = law.slowest(box_.contacts.thermal_speed);
  if (law.rest_speed >= 0) return slowest;
  const double falling = strongest(key) - std::max(0.0, opening_by_forces(key, normal));
  return std::max(slowest, std::sqrt(2 * std::max(0.0, falling) * kRestHeight * distance(key)));
}

template <int D>
RestLimits RestCriterion<D>::limits(const EventKey<D>& key, const Vec<D>& normal, double force, const Vec<D>& v_lo,
                                    const Vec<D>& v_hi) const {
  const bool pair = key.kind == EventKind::pair;
  if (!pair && !box_.options.empty() && box_.wall(key.hi).thermal()) {
    constexpr double kNothing = -std::numeric_limits<double>::min();
    return {kNothing, kNothing, kNothing};
  }
  const double rounding = rounding_speed(key.lo, v_lo) + (pair ? rounding_speed(key.hi, v_hi) : 0.0);
  double closing = pressing(key, normal, force);
  if (pair && !box_.steps.empty() && surface(key, normal).tether())  // a pair that turns pulls at its tether
    closing = std::max(closing, (v_lo - v_hi).squaredNorm() / normal.norm() - opening_by_forces(key, normal));
  const double resting = closing > 0 ? std::max(rounding, speed_of_rest(closing, distance(key))) : rounding;
  if (!dissipates(key)) return {resting, resting, resting};
  return {resting, std::max(resting, slowest_impact(key, normal, closing)),
          lets_open_ ? resting : std::max(resting, slowest_bounce(key, normal, closing))};
}

/// A contact that dissipates stops if it approaches more slowly than this.
template <int D>
double RestCriterion<D>::slowest_impact(const EventKey<D>& key, const Vec<D>& normal, double closing) const {
  const ContactLaw& law = law_of(key);
  // Kicks sustain a bounce with the approach speed n kick/(1 + e) that takes n steps, as long as n ≤ 2e n/(1 + e) + 1.
  const double kick = kick_ * std::max(0.0, closing), e = law.restitution_at({kick, inverse_mass(key)}, 0, 0);
  return rest_speed(key, normal) + kick * std::min(1 / (1 - e), 1.0 * kMostBounces);
}

/// A contact that opens more slowly than this closes again within the step so slowly that it stops.
template <int D>
double RestCriterion<D>::slowest_bounce(const EventKey<D>& key, const Vec<D>& normal, double closing) const {
  if (!dissipates(key)) return 0;
  return std::min(slowest_impact(key, normal, closing), 0.5 * closing * length_);
}

/// Kicks would close a gap that is smaller than what a bounce within a step opens with more energy than the fall gives,
/// and that energy would keep a pile moving. So with kicks the gap is h²/8 times the accelerations of the two spheres.
template <int D>
double RestCriterion<D>::widest_gap(const EventKey<D>& key, const Vec<D>& normal) const {
  if (!dissipates(key)) return 0;
  if (!kicks()) return gap_of(rest_speed(key, normal), strongest(key), distance(key));
  const double both = acceleration(key.lo) + (key.kind == EventKind::pair ? acceleration(key.hi) : 0.0);
  return 0.125 * length_ * length_ * both;
}

template <int D>
double RestCriterion<D>::widest_gap() const {
  if (box_.contacts.elastic()) return 0;
  double strongest = 0, widest = 0, fastest = 0;
  if (a_)
    for (const Vec<D>& a : *a_) strongest = std::max(strongest, a.squaredNorm());
  strongest = std::sqrt(strongest);
  if (kicks()) return 0.25 * length_ * length_ * strongest;
  for (const double radius : particles_.radius) widest = std::max(widest, radius);
  for (const ContactLaw& law : box_.contacts.all()) {
    if (law.elastic()) continue;
    fastest = std::max(fastest, law.slowest(box_.contacts.thermal_speed));
    if (law.rest_speed < 0) fastest = std::max(fastest, std::sqrt(2 * strongest * kRestHeight * 2 * widest));
  }
  return std::max(kOfHeight * kRestHeight * 2 * widest, fastest * length_);
}

template <int D>
bool RestCriterion<D>::falls_back(const EventKey<D>& key, const Vec<D>& normal, double closing, double speed) {
  if (!(closing > 0) || speed > std::max(speed_of_rest(closing, distance(key)), slowest_bounce(key, normal, closing)))
    return false;
  const EventKey<D> partners = without_time(key);
  if (std::ranges::find(fallen_back_, partners, &std::pair<EventKey<D>, double>::first) != fallen_back_.end())
    return false;
  fallen_back_.push_back({partners, closing});
  return true;
}

template class RestCriterion<2>;
template class RestCriterion<3>;

}  // namespace carom
