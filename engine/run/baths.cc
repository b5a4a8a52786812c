// SPDX-License-Identifier: BSD-3-Clause
#include "engine/run/baths.h"

#include "engine/base/elementary.h"
#include "engine/events/thermal_contact.h"
#include "engine/forces/forces.h"

namespace carom {
namespace {

/// A deviate of the gamma distribution of this shape, at least 1, and scale 1 (Marsaglia, Tsang, ACM Trans. Math.
/// Softw. 26 (2000) 363).
double gamma_deviate(double shape, RandomStream& random) {
  const double d = shape - 1.0 / 3, c = 1 / std::sqrt(9 * d);
  for (;;) {
    const double x = random.normal_pair()[0], root = 1 + c * x, v = root * root * root;
    if (root > 0 && elementary::log(random.uniform()) < 0.5 * x * x + d * (1 - v + elementary::log(v))) return d * v;
  }
}

/// The sum of the squares of n normal deviates.
double squared_normals(std::size_t n, RandomStream& random) {
  double sum = 0;
  for (; n % 2 == 1; --n) {
    const double one = random.normal_pair()[0];
    sum = one * one;
  }
  return n == 0 ? sum : sum + 2 * gamma_deviate(0.5 * static_cast<double>(n), random);
}

template <int D>
double kinetic_energy(const System<D>& system, const Vec<D>& centre) {
  const auto& p = system.particles;
  return sum_over_all<D>(system, [&](Id i) { return 0.5 * moving_mass(p.mass[i]) * (p.v[i] - centre).squaredNorm(); });
}

}  // namespace

template <int D>
void rescale(System<D>& system, std::int64_t slab, double time, double length, Counters& counters) {
  constexpr std::uint64_t kBlocksOfSlab = 1024;  // a gamma deviate is rejected with a probability below 0.05
  const Bath& bath = system.box.bath;
  auto& p = system.particles;
  const Vec<D> centre = velocity_of_centre(system);
  const double before = kinetic_energy<D>(system, Vec<D>::Zero()), kinetic = kinetic_energy(system, centre);
  if (!(kinetic > 0)) {
    if (kinetic == 0 && bath.temperature_at(time) > 0 &&
        std::ranges::none_of(system.box.options, [](const auto& wall) { return wall.moves(); }))
      throw Error(Failure::numerical,
                  "the particles have come to rest, and a rescaling bath cannot heat particles at rest, because it "
                  "multiplies velocities; take type = \"andersen\"");
    return;
  }
  // The kinetic energy of the centre of mass counts as one of D N degrees of freedom, as in the column `temperature`.
  const std::size_t freedoms = D * system.moving();
  RandomStream random(bath.seed, RandomPurpose::rescaling, 0, kBlocksOfSlab * static_cast<std::uint64_t>(slab));
  const double kept = elementary::exp(-length * bath.rate), fresh = -elementary::expm1(-length * bath.rate);
  const double of_one = 0.5 * bath.temperature_at(time) / kinetic;  // the mean energy of a degree of freedom / K
  const double first = random.normal_pair()[0], others = squared_normals(freedoms - 1, random);
  const double squared =
      kept + fresh * of_one * (first * first + others) + 2 * first * std::sqrt(kept * fresh * of_one);
  const double factor = std::sqrt(squared);
  for (Vec<D>& v : p.v) v = centre + factor * (v - centre);
  counters.heat.add(kinetic_energy<D>(system, Vec<D>::Zero()) - before);
}

template <int D>
void kick_all(System<D>& system, double start, double length, Counters& counters) {
  const Bath& bath = system.box.bath;
  auto& p = system.particles;
  std::vector<double> gained(p.size(), 0.0);
  std::uint64_t kicks = 0;
  for (Id i = 0; i < p.size(); ++i) {
    if (p.fixed(i)) continue;
    const Id id = p.id_of(i);
    double last = 0;  // only the last kick of a step matters
    for (double t = 0; (t = bath.next_kick(id, start, t, length)) <= length; last = t)
      if (p.owns(i)) ++kicks;
    if (last == 0) continue;
    const double before = p.v[i].squaredNorm();
    p.v[i] = kicked_velocity<D>(bath, p.mass[i], {.id = id, .time = start + last});
    gained[i] = 0.5 * p.mass[i] * (p.v[i].squaredNorm() - before);
  }
  system.decomposition.ranks().sum({&kicks, 1});
  counters.kicks += kicks;
  counters.heat.add(sum_over_all<D>(system, [&](Id i) { return gained[i]; }));
}

template <int D>
void damp(System<D>& system, double time, double length, Counters& counters) {
  const Bath& bath = system.box.bath;
  auto& p = system.particles;
  std::vector<double> gained(p.size(), 0.0);
  for (Id i = 0; i < p.size(); ++i) {
    if (p.fixed(i)) continue;
    const double decay = -length * bath.friction_of(p.species[i]), before = p.v[i].squaredNorm();
    const double kept = elementary::exp(decay), fresh = std::sqrt(-elementary::expm1(2 * decay));
    p.v[i] = kept * p.v[i] + fresh * kicked_velocity<D>(bath, p.mass[i], {.id = p.id_of(i), .time = time});
    gained[i] = 0.5 * p.mass[i] * (p.v[i].squaredNorm() - before);
  }
  counters.heat.add(sum_over_all<D>(system, [&](Id i) { return gained[i]; }));
}

template void damp(System<2>&, double, double, Counters&);
template void damp(System<3>&, double, double, Counters&);
template void rescale(System<2>&, std::int64_t, double, double, Counters&);
template void rescale(System<3>&, std::int64_t, double, double, Counters&);
template void kick_all(System<2>&, double, double, Counters&);
template void kick_all(System<3>&, double, double, Counters&);

}  // namespace carom
