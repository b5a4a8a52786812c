// SPDX-License-Identifier: BSD-3-Clause
#include "engine/events/shaken_contact.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "engine/base/normal_deviates.h"
#include "engine/events/contact.h"

namespace carom {
namespace {
constexpr double kTwoPi = 2 * std::numbers::pi;
constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
}  // namespace

double ShakenGap::at(double s) const {
  return y + s * (v + 0.5 * a * s) - amplitude * cosine_and_sine(turns + frequency * s)[1];
}

double ShakenGap::slope(double s) const {
  return v + a * s - kTwoPi * frequency * amplitude * cosine_and_sine(turns + frequency * s)[0];
}

// The second derivative of the gap is nowhere below −most. From any time on, the gap is therefore at least that of a
// parabola with this second derivative, and the root of the parabola is a time before the contact. These times converge
// to the contact as fast as Newton's, from before it. Where the sphere is beyond the reach of the sine, the time at
// which it comes into its reach is exact.
double ShakenGap::first_contact(double time_left, bool touching, double slack) const {
  const double reach = std::abs(amplitude), omega = kTwoPi * frequency;
  const double most = std::max(omega * omega * reach - a, kEpsilon * omega * omega * reach);
  const double scale = std::abs(y) + reach;
  // Rounding moves a phase by as much: a shorter step might not come on.
  const auto least = [&](double at) { return 2 * kEpsilon * (at + std::abs(turns) / frequency); };
  double s = 0;
  if (touching) {
    const double departing = slope(0);
    if (departing < -slack) return 0;
    s = 2 * std::max(departing, 0.0) / most;
    if (departing <= slack) {  // it moves with the wall: does it separate?
      const auto [cos, sin] = cosine_and_sine(turns);
      const double apart = a + omega * omega * amplitude * sin;
      if (apart <= 0) return 0;
      s = std::max(s, 1.5 * apart / (omega * omega * omega * reach));  // third derivative: half the safe time
    }
  }
  while (s < time_left) {
    const double above = y + s * (v + 0.5 * a * s) - reach;
    if (above > kEpsilon * scale) {
      const double in_reach = wall_contact_time(above, v + a * s, a, time_left - s, false, 0);
      if (in_reach == kNever) return kNever;
      s += in_reach;
    }
    const double gap = at(s), falling = -slope(s);
    if (gap <= 4 * kEpsilon * scale && falling > 0) return s < time_left ? s : kNever;
    const double root = std::sqrt(falling * falling + 2 * most * std::max(gap, 0.0));
    const double ahead = falling > 0 ? 2 * gap / (root + falling) : (root - falling) / most;
    const double next = s + std::max(ahead, least(s));
    if (next == s) return falling > 0 ? s : kNever;
    s = next;
  }
  return kNever;
}

}  // namespace carom
