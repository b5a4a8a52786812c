#include "engine/contact_scan.h"

#include <algorithm>
#include <string>

#include "engine/collision.h"
#include "engine/error.h"

namespace carom {

template <int D>
ContactScan<D>::ContactScan(const System<D>& system, std::uint64_t max_events)
    : box_(system.box),
      particles_(system.particles),
      largest_edge_(system.box.edges.maxCoeff()),
      list_(system.box, system.particles.radius),
      max_events_(max_events) {}

template <int D>
void ContactScan<D>::begin_slab(Counters& counters, std::vector<Contact<D>>* contacts) {
  counters_ = &counters;
  contacts_ = contacts;
  events_ = 0;
}

template <int D>
double ContactScan<D>::wall_gap(const Vec<D>& x, Id i, int wall) const {
  const int axis = wall / 2;
  return wall % 2 == 0 ? x[axis] - particles_.radius[i] : box_.edges[axis] - particles_.radius[i] - x[axis];
}

template <int D>
void ContactScan<D>::collect(double time, Positions<D> x, std::span<const Vec<D>> v) {
  touching_.clear();
  auto note = [&](const EventKey<D>& key, const Vec<D>& normal, double gap, double sigma) {
    counters_->max_overlap = std::max(counters_->max_overlap, -gap / sigma);
    const Touch<D> touch{key, normal};
    if (approaches(touch, v)) touching_.push_back(touch);
  };
  EventKey<D> key;
  key.time = time;
  for (const auto& pair : list_.cover(x)) {
    const Vec<D> d = x[pair.i] - x[pair.j] + box_.shift(pair.image);
    const double sigma = contact_distance(pair.i, pair.j), reach = sigma + tolerance(sigma);
    if (d.squaredNorm() > reach * reach) continue;
    key.lo = pair.i;
    key.hi = pair.j;
    key.image = pair.image;
    note(key, d, d.norm() - sigma, sigma);
  }
  key.kind = EventKind::wall;
  key.image = {};
  for (Id i = 0; i < x.size(); ++i)
    for (int wall = 0; wall < 2 * D; ++wall) {
      if (!box_.walled(wall / 2)) continue;
      const double gap = wall_gap(x[i], i, wall);
      if (gap > tolerance(particles_.radius[i])) continue;
      key.lo = i;
      key.hi = static_cast<Id>(wall);
      note(key, inward(wall) * Vec<D>::Unit(wall / 2), gap, particles_.radius[i]);
    }
}

template <int D>
bool ContactScan<D>::approaches(const Touch<D>& touch, std::span<const Vec<D>> v) const {
  const Vec<D>& v_lo = v[touch.key.lo];
  if (!touch.pair()) return touch.normal.dot(v_lo) < -approach_slack(1.0, v_lo.norm(), 0.0);
  const Vec<D>& v_hi = v[touch.key.hi];
  return touch.normal.dot(v_lo - v_hi) < -approach_slack(touch.normal.norm(), v_lo.norm(), v_hi.norm());
}

template <int D>
void ContactScan<D>::count_event(const EventKey<D>& key) {
  if (++events_ > max_events_)
    throw Error(Failure::numerical, "more than max_events_per_step = " + std::to_string(max_events_) +
                                        " collisions in one step, the last between " + partners(key) +
                                        "; use a smaller step or raise integrator.max_events_per_step");
}

template <int D>
void ContactScan<D>::fail_resting(const EventKey<D>& key) const {
  throw Error(Failure::numerical, partners(key) +
                                      " rest in contact, pressed together, and would bounce without end; "
                                      "separate them or give them a relative velocity");
}

template <int D>
bool ContactScan<D>::resolve(double time, Positions<D> x, std::span<const Vec<D>> v,
                             const std::function<void(const Touch<D>&)>& impulse) {
  collect(time, x, v);
  std::uint32_t generation = 0;
  for (; !touching_.empty(); ++generation) {
    std::ranges::sort(touching_, {}, &Touch<D>::key);
    for (Touch<D>& touch : touching_) {
      if (!approaches(touch, v)) continue;  // an earlier impulse of this round has parted them
      touch.key.generation = generation;
      count_event(touch.key);
      const Id lo = touch.key.lo, hi = touch.key.hi;
      const Vec<D> v_before = v[lo];
      impulse(touch);
      const Vec<D> given = particles_.mass[lo] * (v[lo] - v_before);
      Contact<D> contact{touch.key, x[lo], x[lo], given};
      if (touch.pair()) {
        ++counters_->sphere_sphere;
        counters_->collision_virial.add(touch.normal.dot(given));
        contact.x_hi = x[hi] - box_.shift(touch.key.image);
      } else {
        ++counters_->sphere_wall;
        contact.x_hi[hi / 2] = hi % 2 == 0 ? 0.0 : box_.edges[static_cast<int>(hi / 2)];
      }
      if (contacts_) contacts_->push_back(contact);
    }
    collect(time, x, v);
  }
  return generation > 0;
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
    if (key < first.key) first = {key, normal};
  };
  for (const auto& pair : list_.cover(x, path)) {
    const Vec<D> d = x[pair.i] - x[pair.j] + box_.shift(pair.image);
    const double sigma = contact_distance(pair.i, pair.j), gap_squared = d.squaredNorm() - sigma * sigma;
    const double touching_reach = sigma + tolerance(sigma);
    const bool touching = gap_squared <= touching_reach * touching_reach - sigma * sigma;
    key.lo = pair.i;
    key.hi = pair.j;
    key.image = pair.image;
    key.time = contact_time<D>(d, v[pair.i] - v[pair.j], a[pair.i] - a[pair.j], sigma, rest, touching,
                               approach_slack(sigma, v[pair.i].norm(), v[pair.j].norm()));
    if (key.time < kNever) offer(d);
  }
  key.kind = EventKind::wall;
  key.image = {};
  for (Id i = 0; i < x.size(); ++i)
    for (int wall = 0; wall < 2 * D; ++wall) {
      const int axis = wall / 2;
      if (!box_.walled(axis)) continue;
      const double gap = wall_gap(x[i], i, wall);
      key.lo = i;
      key.hi = static_cast<Id>(wall);
      key.time = wall_contact_time(gap, inward(wall) * v[i][axis], inward(wall) * a[i][axis], rest,
                                   gap <= tolerance(particles_.radius[i]), approach_slack(1.0, v[i].norm(), 0.0));
      if (key.time < kNever) offer(inward(wall) * Vec<D>::Unit(axis));
    }
  if (first.key.time == 0) fail_resting(first.key);
  return first;
}

template <int D>
void collide_elastically(const Touch<D>& touch, Particles<D>& particles) {
  const Id lo = touch.key.lo, hi = touch.key.hi;
  if (!touch.pair()) {
    double& v = particles.v[lo][static_cast<int>(hi / 2)];
    v = -v;
    return;
  }
  const double mass_lo = particles.mass[lo], mass_hi = particles.mass[hi];
  const double g = collision_factor<D>(touch.normal, particles.v[lo] - particles.v[hi], mass_lo, mass_hi);
  particles.v[lo] += (g / mass_lo) * touch.normal;
  particles.v[hi] -= (g / mass_hi) * touch.normal;
}

template <int D>
std::string partners(const EventKey<D>& key) {
  if (key.kind == EventKind::pair) return "particles " + std::to_string(key.lo) + " and " + std::to_string(key.hi);
  return "particle " + std::to_string(key.lo) + " and the " + (key.hi % 2 == 0 ? "lower" : "upper") + " wall of axis " +
         std::to_string(key.hi / 2);
}

template class ContactScan<2>;
template class ContactScan<3>;
template void collide_elastically<2>(const Touch<2>&, Particles<2>&);
template void collide_elastically<3>(const Touch<3>&, Particles<3>&);
template std::string partners<2>(const EventKey<2>&);
template std::string partners<3>(const EventKey<3>&);

}  // namespace carom
