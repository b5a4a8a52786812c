// SPDX-License-Identifier: BSD-3-Clause
#include "engine/events/thermal_contact.h"

#include <bit>

#include "engine/base/elementary.h"
#include "engine/base/random.h"

namespace carom {
namespace {

/// A bijection of 64 bits that changes about half of them for each bit that changes (Stafford's variant 13 of the
/// finalizer of MurmurHash3, as in SplitMix64: Steele, Lea, Flood, OOPSLA (2014)).
std::uint64_t mixed(std::uint64_t z) {
  z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9;
  z = (z ^ z >> 27) * 0x94d049bb133111eb;
  return z ^ z >> 31;
}

/// A contact or kick uses at most four blocks.
RandomStream stream_of(std::uint64_t seed, RandomPurpose purpose, const Draw& draw) {
  const std::uint64_t event = mixed(mixed(std::bit_cast<std::uint64_t>(draw.time)) + draw.number);
  return {seed, purpose, draw.id, event >> 4 << 2};
}

template <int D>
Vec<D> normal_velocity(double speed, RandomStream& random) {
  const auto one = random.normal_pair(), two = random.normal_pair();
  Vec<D> v;
  for (int k = 0; k < D; ++k) v[k] = speed * (k < 2 ? one[k] : two[0]);
  return v;
}

}  // namespace

template <int D>
Vec<D> thermal_velocity(const Wall<D>& wall, double mass, const Draw& draw, double t) {
  RandomStream random = stream_of(wall.seed, RandomPurpose::thermal_wall, draw);
  const double speed = std::sqrt(wall.temperature / mass);
  const Vec<D> v = normal_velocity<D>(speed, random);
  const double away = speed * std::sqrt(-2 * elementary::log(random.uniform()));
  return v + (wall.velocity_at(t) + away - wall.along_normal(v)) * wall.normal;
}

template <int D>
Vec<D> kicked_velocity(const Bath& bath, double mass, const Draw& draw) {
  RandomStream random = stream_of(bath.seed, RandomPurpose::kick, draw);
  return normal_velocity<D>(std::sqrt(bath.temperature_at(draw.time) / mass), random);
}

template Vec<2> thermal_velocity(const Wall<2>&, double, const Draw&, double);
template Vec<3> thermal_velocity(const Wall<3>&, double, const Draw&, double);
template Vec<2> kicked_velocity(const Bath&, double, const Draw&);
template Vec<3> kicked_velocity(const Bath&, double, const Draw&);

}  // namespace carom
