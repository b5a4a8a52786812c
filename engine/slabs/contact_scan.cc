#include "engine/slabs/contact_scan.h"

#include <algorithm>
#include <array>
#include <string>

#include "engine/base/error.h"
#include "engine/events/collision.h"

namespace carom {

template <int D>
ContactScan<D>::ContactScan(const System<D>& system, std::uint64_t max_events)
    : box_(system.box),
      particles_(system.particles),
      decomposition_(system.decomposition),
      walls_(system.box.walls()),
      tolerance_(system.box.gap_tolerance()),
      list_(system.box, system.particles.radius),
      max_events_(max_events) {}

template <int D>
void ContactScan<D>::begin_slab(Counters& counters, std::vector<Contact<D>>* contacts, Positions<D> a, double length,
                                SlabWatch* watch) {
  counters_ = &counters;
  contacts_ = contacts;
  watch_ = watch;
  events_ = 0;
  events_at_last_cut_ = std::numeric_limits<std::uint64_t>::max();
  std::array<double, 2> most{};  // squared speed and acceleration
  for (const auto& v : particles_.v) most[0] = std::max(most[0], v.squaredNorm());
  for (const auto& each : a) most[1] = std::max(most[1], each.squaredNorm());
  decomposition_.ranks().largest(most);
  resting_speed_ = kRestingSpeed * (std::sqrt(most[0]) + length * std::sqrt(most[1]));
}

template <int D>
void ContactScan<D>::collect(double time, Positions<D> x, Positions<D> v) {
  if (box_.pistons())
    throw Error(Failure::deck, "this method knows no walls that move; take free-flight or psa, or stop them");
  approaching_.clear();
  resting_.clear();
  auto note = [&](const EventKey<D>& key, const Vec<D>& normal, double gap, double sigma) {
    counters_->max_overlap = std::max(counters_->max_overlap, -gap / sigma);
    const Touch<D> touch{key, normal};
    const double speed = normal_speed(touch, v);
    if (speed < -resting_speed_)
      approaching_.push_back(touch);
    else if (speed <= resting_speed_)
      resting_.push_back({key, normal});
  };
  EventKey<D> key;
  key.time = time;
  for (const auto& pair : list_.cover(x)) {
    const Vec<D> d = x[pair.i] - x[pair.j] + box_.shift(pair.image);
    const double sigma = contact_distance(pair.i, pair.j);
    if (!touches(d, sigma)) continue;
    key.lo = pair.i;
    key.hi = pair.j;
    key.image = pair.image;
    note(key, d, d.norm() - sigma, sigma);
  }
  key.kind = EventKind::wall;
  key.image = {};
  for (Id i = 0; i < x.size(); ++i)
    for (const Wall<D>& wall : walls_) {
      const double gap = wall.gap(x[i], particles_.radius[i]);
      if (gap > tolerance(particles_.radius[i])) continue;
      key.lo = i;
      key.hi = wall.number();
      note(key, wall.normal(), gap, particles_.radius[i]);
    }
}

template <int D>
double ContactScan<D>::normal_speed(const Touch<D>& touch, Positions<D> v) const {
  if (!touch.pair()) return touch.normal.dot(v[touch.key.lo]);
  return touch.normal.dot(v[touch.key.lo] - v[touch.key.hi]) / touch.normal.norm();
}

template <int D>
void ContactScan<D>::count_event(const EventKey<D>& key) {
  if (++events_ > max_events_) throw_too_many_contacts(max_events_, partners(key));
}

template <int D>
void ContactScan<D>::commit(double time, std::span<const Contact<D>> executed) {
  for (Contact<D> contact : executed) {
    count_event(contact.key);
    contact.key.time += time;
    counters_->record(contact, contacts_);
  }
}

template <int D>
void ContactScan<D>::resolve(double time, Positions<D> x, Vectors<D> v,
                             const std::function<void(const Touch<D>&)>& impulse) {
  collect(time, x, v);
  for (std::uint32_t generation = 0; !approaching_.empty(); ++generation) {
    std::ranges::sort(approaching_, {}, &Touch<D>::key);
    for (Touch<D>& touch : approaching_) {
      if (!(normal_speed(touch, v) < -resting_speed_)) continue;  // an earlier impulse of this round has parted them
      touch.key.generation = generation;
      count_event(touch.key);
      if (watch_) watch_->cut();
      const Id lo = touch.key.lo, hi = touch.key.hi;
      const Vec<D> v_before = v[lo];
      impulse(touch);
      const Vec<D> given = particles_.mass[lo] * (v[lo] - v_before);
      Contact<D> contact{touch.key, x[lo], x[lo], given};
      if (touch.pair()) {
        contact.virial = touch.normal.dot(given);
        contact.x_hi = x[hi] - box_.shift(touch.key.image);
      } else {
        contact.x_hi = box_.wall(hi).foot(x[lo]);
      }
      counters_->record(contact, contacts_);
    }
    collect(time, x, v);
  }
  if (resting_.empty()) return;
  if (watch_) watch_->cut();
  stop_approach(x, v);
}

template <int D>
bool ContactScan<D>::rests(const EventKey<D>& key) const {
  return std::ranges::any_of(resting_, [&](const auto& contact) { return same_partners(contact.key, key); });
}

template <int D>
void ContactScan<D>::hold(Positions<D> v, Vectors<D> a, double rest) {
  for (auto& contact : resting_) {
    contact.lambda = contact.bound = 0;
    if (contact.key.kind != EventKind::pair) continue;
    // d·d − σ² = s² ((u² + d·a) + (u·a) s + ¼ a² s²) must not be negative up to `rest`. A pair that turns (u) while it
    // is braked (u·a < 0) would go in by the second term; u·a is not changed by the reaction, which is normal to u.
    const Vec<D> u = v[contact.key.lo] - v[contact.key.hi];
    const double braking = std::max(0.0, -u.dot(a[contact.key.lo] - a[contact.key.hi]));
    contact.bound = braking * rest - u.squaredNorm();
  }
  press_apart<D>(resting_, particles_.mass, a);
  std::erase_if(resting_, [](const auto& contact) { return contact.lambda == 0; });  // they leave, and may come back
}

template <int D>
void ContactScan<D>::stop_approach(Positions<D> x, Vectors<D> v) {
  for (auto& contact : resting_) {
    if (contact.key.kind == EventKind::pair)
      contact.normal = x[contact.key.lo] - x[contact.key.hi] + box_.shift(contact.key.image);
    contact.lambda = contact.bound = 0;
  }
  press_apart<D>(resting_, particles_.mass, v);
}

template <int D>
void ContactScan<D>::slide(Positions<D> x, Vectors<D> v) {
  constexpr int kMostSweeps = 100;
  constexpr double kSteepest = 0.1;  // normal against tangential speed: beyond, it is an impact and no sliding
  bool turned = true;
  for (int sweep = 0; turned && sweep < kMostSweeps; ++sweep) {
    turned = false;
    for (const auto& contact : resting_) {
      if (contact.lambda == 0) continue;
      const Id lo = contact.key.lo, hi = contact.key.hi;
      const bool pair = contact.key.kind == EventKind::pair;
      const Vec<D> normal =
          (pair ? Vec<D>(x[lo] - x[hi] + box_.shift(contact.key.image)) : contact.normal).normalized();
      const Vec<D> u = pair ? Vec<D>(v[lo] - v[hi]) : v[lo];
      const double along = u.dot(normal);
      const Vec<D> tangent = u - along * normal;
      if (std::abs(along) <= 0.1 * resting_speed_ || std::abs(along) > kSteepest * tangent.norm()) continue;
      const Vec<D> change = tangent * (u.norm() / tangent.norm()) - u;
      const double share = pair ? particles_.mass[hi] / (particles_.mass[lo] + particles_.mass[hi]) : 1.0;
      v[lo] += share * change;
      if (pair) v[hi] -= (1 - share) * change;
      turned = true;
    }
  }
}

template <int D>
Touch<D> ContactScan<D>::earliest(Positions<D> x, Positions<D> v, Positions<D> a, double rest) {
  const Stopwatch watch(counters_->seconds.predict);
  Touch<D> first;
  first.key.time = kNever;
  double fastest = 0, strongest = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    fastest = std::max(fastest, v[i].squaredNorm());
    strongest = std::max(strongest, a[i].squaredNorm());
  }
  const double path = rest * (std::sqrt(fastest) + 0.5 * rest * std::sqrt(strongest));
  EventKey<D> key;
  auto offer = [&](const Vec<D>& normal) {
    // At time 0 only resting contacts are left; hold() has seen to those that are pressed together.
    if (key.time > 0 && key < first.key) first = {key, normal};
  };
  for (const auto& pair : list_.cover(x, path)) {
    const Vec<D> d = x[pair.i] - x[pair.j] + box_.shift(pair.image);
    const double sigma = contact_distance(pair.i, pair.j);
    key.lo = pair.i;
    key.hi = pair.j;
    key.image = pair.image;
    key.time = contact_time<D>(d, v[pair.i] - v[pair.j], a[pair.i] - a[pair.j], sigma, rest, touches(d, sigma),
                               sigma * resting_speed_);
    if (key.time < kNever) offer(d);
  }
  key.kind = EventKind::wall;
  key.image = {};
  for (Id i = 0; i < x.size(); ++i)
    for (const Wall<D>& wall : walls_) {
      const double gap = wall.gap(x[i], particles_.radius[i]);
      key.lo = i;
      key.hi = wall.number();
      key.time = wall_contact_time(gap, wall.along_normal(v[i]), wall.along_normal(a[i]), rest,
                                   gap <= tolerance(particles_.radius[i]), resting_speed_);
      if (key.time < kNever) offer(wall.normal());
    }
  // Pieces that end in a contact without an impulse count too: there must be an end to them.
  if (first.key.time < kNever && events_ == events_at_last_cut_) count_event(first.key);
  events_at_last_cut_ = events_;
  return first;
}

template <int D>
void collide_elastically(const Touch<D>& touch, Particles<D>& particles) {
  const Id lo = touch.key.lo, hi = touch.key.hi;
  if (!touch.pair()) {
    double& v = particles.v[lo][wall_axis(hi)];
    v = -v;
    return;
  }
  const double mass_lo = particles.mass[lo], mass_hi = particles.mass[hi];
  const double g = collision_factor<D>(touch.normal, particles.v[lo] - particles.v[hi], mass_lo, mass_hi);
  particles.v[lo] += (g / mass_lo) * touch.normal;
  particles.v[hi] -= (g / mass_hi) * touch.normal;
}

template class ContactScan<2>;
template class ContactScan<3>;
template void collide_elastically<2>(const Touch<2>&, Particles<2>&);
template void collide_elastically<3>(const Touch<3>&, Particles<3>&);

}  // namespace carom
