// SPDX-License-Identifier: BSD-3-Clause
#include "engine/events/rough_contact.h"

#include <cmath>

namespace carom {
namespace {

template <int D>
double moment_of(const ContactLaws& laws, const Partner<D>& a) {
  return laws.moment(a.species, a.mass, a.radius, D);
}

/// `resisting`: 1/m of the header; `pressing`: the normal impulse.
template <int D>
TangentialImpulse<D> rub(const ContactLaw& law, const Vec<D>& slip, double resisting, double pressing) {
  const double square = slip.squaredNorm(), most = law.friction * pressing * resisting;
  double q = 1 + *law.tangential;
  if (q * q * square > most * most) q = most / std::sqrt(square);
  return {(-q / resisting) * slip, q * (1 - 0.5 * q) * square / resisting};
}

}  // namespace

template <int D>
TangentialImpulse<D> rub_pair(const ContactLaws& laws, const Vec<D>& d, const Vec<D>& v, double factor,
                              const Partner<D>& a, const Partner<D>& b) {
  const ContactLaw& law = laws.of_pair(a.species, b.species);
  const double dv = d.dot(v), square = d.squaredNorm();
  if (!law.rubs(std::sqrt(dv * dv / square), laws.thermal_speed)) return {};
  const double sigma = a.radius + b.radius, moment_a = moment_of(laws, a), moment_b = moment_of(laws, b);
  const Vec<D> arm_a = (a.radius / sigma) * d, arm_b = (b.radius / sigma) * d;
  Vec<D> slip = v - (turned<D>(a.internal->spin, arm_a) + turned<D>(b.internal->spin, arm_b));
  slip -= (slip.dot(d) / square) * d;
  const double resisting =
      (1 / a.mass + 1 / b.mass) + (arm_a.squaredNorm() / moment_a + arm_b.squaredNorm() / moment_b);
  TangentialImpulse<D> rubbed = rub<D>(law, slip, resisting, factor * std::sqrt(square));
  a.internal->spin -= torque<D>(arm_a, rubbed.impulse) / moment_a;
  b.internal->spin -= torque<D>(arm_b, rubbed.impulse) / moment_b;
  return rubbed;
}

template <int D>
TangentialImpulse<D> rub_wall(const ContactLaws& laws, std::uint32_t wall, const Vec<D>& normal, const Vec<D>& v,
                              double closing, double pressing, const Partner<D>& a) {
  const ContactLaw& law = laws.of_wall(a.species, wall);
  if (!law.rubs(closing, laws.thermal_speed)) return {};
  const double moment = moment_of(laws, a);
  const Vec<D> arm = a.radius * normal;
  Vec<D> slip = v - turned<D>(a.internal->spin, arm);
  slip -= slip.dot(normal) * normal;
  TangentialImpulse<D> rubbed = rub<D>(law, slip, 1 / a.mass + arm.squaredNorm() / moment, pressing);
  a.internal->spin -= torque<D>(arm, rubbed.impulse) / moment;
  return rubbed;
}

template TangentialImpulse<2> rub_pair(const ContactLaws&, const Vec<2>&, const Vec<2>&, double, const Partner<2>&,
                                       const Partner<2>&);
template TangentialImpulse<3> rub_pair(const ContactLaws&, const Vec<3>&, const Vec<3>&, double, const Partner<3>&,
                                       const Partner<3>&);
template TangentialImpulse<2> rub_wall(const ContactLaws&, std::uint32_t, const Vec<2>&, const Vec<2>&, double, double,
                                       const Partner<2>&);
template TangentialImpulse<3> rub_wall(const ContactLaws&, std::uint32_t, const Vec<3>&, const Vec<3>&, double, double,
                                       const Partner<3>&);

}  // namespace carom
