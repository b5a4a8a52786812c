// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The time at which two spheres, or a sphere and a wall, touch: pure functions of the relative motion.
//
// d = x_i − x_j is the separation of the centres (of the chosen image), v and a its derivatives, sigma = r_i + r_j the
// contact distance. Times count from now. A contact is the first time at which the gap is not positive and decreasing:
// spheres that overlap by rounding and separate do not collide, spheres that overlap and approach touch at once. Pairs
// in a well, and spheres in a round wall, leave at leaving_time().
//
//   const double s = contact_time(d, v, sigma, slack);            // straight flights
//   const double s = contact_time(d, v, sigma, w, slack);         // straight flights of spheres that grow
//   const double s = contact_time(d, v, a, sigma, time_left, slack);   // parabolas, sought in [0, time_left)
//
// For touching pairs, an approach slower than `slack` (the rounding of velocities, see approach_slack) does not count:
// no impulse could change it, so the contact would repeat without end.

#include <algorithm>
#include <cmath>

#include "engine/base/vec.h"
#include "engine/events/polynomial.h"

namespace carom {

/// Rounding error of d·v for two touching spheres with these speeds.
inline double approach_slack(double sigma, double speed_i, double speed_j) {
  return 8 * std::numeric_limits<double>::epsilon() * sigma * (speed_i + speed_j);
}

/// |d × v|², the squared area spanned by d and v. Unlike d²v² − (d·v)² it has no cancellation.
template <int D>
double squared_cross(const Vec<D>& d, const Vec<D>& v) {
  const double z = d[0] * v[1] - d[1] * v[0];
  if constexpr (D == 2) return z * z;
  if constexpr (D == 3) {
    const double x = d[1] * v[2] - d[2] * v[1], y = d[2] * v[0] - d[0] * v[2];
    return x * x + y * y + z * z;
  }
}

/// Straight relative motion: the smaller root of |d + v s|² = sigma², in the form without cancellation.
template <int D>
double contact_time(const Vec<D>& d, const Vec<D>& v, double sigma, double slack) {
  const double b = d.dot(v);
  if (b >= 0) return kNever;
  const double c = d.squaredNorm() - sigma * sigma;
  if (c <= 0) return b < -slack ? 0.0 : kNever;
  const double discriminant = v.squaredNorm() * sigma * sigma - squared_cross<D>(d, v);
  if (discriminant <= 0) return kNever;
  return c / (std::sqrt(discriminant) - b);
}

/// For growing spheres: the first s ≥ 0 with |d + v s| = sigma + w s, where w ≥ 0 is the rate of the contact distance
/// (Lubachevsky, Stillinger, J. Stat. Phys. 60 (1990) 561). With w = 0 it gives the bits of the function above.
///
/// With A = v² − w², b = d·v − sigma w and c = d² − sigma², the squared gap is c + 2 b s + A s². If A < 0, growth
/// overtakes even spheres that separate. Spheres that touch and separate have A ≥ 0 and never meet again.
template <int D>
double contact_time(const Vec<D>& d, const Vec<D>& v, double sigma, double w, double slack) {
  const double dv = d.dot(v), b = dv - sigma * w;
  const double outrun = v.squaredNorm() - w * w;
  if (b >= 0 && outrun >= 0) return kNever;
  const double c = d.squaredNorm() - sigma * sigma;
  if (c <= 0) return b < -slack ? 0.0 : kNever;
  const double discriminant =
      v.squaredNorm() * sigma * sigma - squared_cross<D>(d, v) + w * (w * d.squaredNorm() - 2 * sigma * dv);
  if (discriminant <= 0) return kNever;
  const double root = std::sqrt(discriminant);
  return b < 0 ? c / (root - b) : (b + root) / -outrun;  // the form of the root without cancellation
}

/// Far more than the rounding of the distance at which two spheres pass each other, relative to its terms.
inline constexpr double kBendMargin = 1e-9;

/// Parabolic relative motion d + v s + a s²/2, with s in [0, time_left). `touching` divides out the root s = 0 of a
/// pair in contact. The time is 0 for a touching pair that approaches, and for one at rest that is pressed together.
template <int D>
double contact_time(const Vec<D>& d, const Vec<D>& v, const Vec<D>& a, double sigma, double time_left, bool touching,
                    double slack) {
  const double c0 = d.squaredNorm() - sigma * sigma;
  const double b = d.dot(v);
  if (!touching) {  // most pairs are too far apart: compare the distance with the path length
    const double path = time_left * (v.norm() + 0.5 * time_left * a.norm());
    if (c0 > 0 && path * (path + 2 * sigma) < c0) return kNever;
    // Most other pairs pass each other: their parabola is never farther from the straight path than `bend`.
    const double bend = (0.5 + kBendMargin) * time_left * time_left * a.norm();
    const double closest = b < 0 ? std::min(time_left, -b / v.squaredNorm()) : 0.0;
    const double passing = (1 + kBendMargin) * sigma + bend;
    if ((d + closest * v).squaredNorm() > passing * passing) return kNever;
  }
  const Polynomial<4> gap{{c0, 2 * b, v.squaredNorm() + d.dot(a), v.dot(a), 0.25 * a.squaredNorm()}};
  double s;
  if (touching) {
    if (b < -slack) return 0;
    const double departing = b <= slack ? 0.0 : 2 * b;
    s = first_fall(Polynomial<3>{{departing, gap.c[2], gap.c[3], gap.c[4]}}, time_left);
  } else {
    s = first_fall(gap, time_left);
  }
  if (s == 0 || s == kNever) return s;
  const Vec<D> at = d + s * v + (0.5 * s * s) * a;  // a Newton step on the vectors themselves
  const double falling = at.dot(v + s * a);
  if (falling < 0) {
    const double correction = 0.5 * (at.squaredNorm() - sigma * sigma) / falling;
    if (std::abs(correction) < 1e-6 * s) s -= correction;
  }
  return s < time_left ? s : kNever;
}

/// The motion of a pair: d = x_i − x_j of the image that is near, v its velocity, and b = d·v; or the motion of a
/// sphere in a round wall, relative to its centre.
template <int D>
struct PairMotion {
  Vec<D> d, v;
  double b = d.dot(v), distance = d.norm();
};

/// Straight relative motion: the first time at which |d + v s| is not below range − w s and grows relative to it. w ≥ 0
/// is the rate at which the range shrinks: inside a wall, for a sphere that grows. The form of the root is that of
/// contact_time(), with the opposite sign of w.
template <int D>
double leaving_time(const PairMotion<D>& motion, double range, double slack, double w = 0) {
  const auto& [d, v, dv, distance] = motion;
  const double b = dv + range * w, outrun = v.squaredNorm() - w * w, c = d.squaredNorm() - range * range;
  if (outrun == 0 && b <= 0) return kNever;
  if (c >= 0 && b >= 0) return b > slack ? 0.0 : (2 * slack - b) / outrun;  // on a tangent, until it clearly recedes
  const double discriminant =
      v.squaredNorm() * range * range - squared_cross<D>(d, v) + w * (w * d.squaredNorm() + 2 * range * dv);
  const double root = std::sqrt(std::max(0.0, discriminant));
  return b > 0 ? -c / (b + root) : (root - b) / outrun;
}

/// Parabolic relative motion d + v s + a s²/2: as above, in [0, time_left). `touching` divides out the root s = 0 of a
/// pair that is at `range`.
template <int D>
double leaving_time(const PairMotion<D>& motion, const Vec<D>& a, double range, double time_left, bool touching,
                    double slack) {
  const auto& [d, v, b, distance] = motion;
  const double c0 = range * range - d.squaredNorm();
  const Polynomial<4> room{{c0, -2 * b, -v.squaredNorm() - d.dot(a), -v.dot(a), -0.25 * a.squaredNorm()}};
  double s;
  if (touching) {
    if (b > slack) return 0;
    s = first_fall(Polynomial<3>{{b >= -slack ? 0.0 : -2 * b, room.c[2], room.c[3], room.c[4]}}, time_left);
  } else {
    s = first_fall(room, time_left);
  }
  if (s == 0 || s == kNever) return s;
  const Vec<D> at = d + s * v + (0.5 * s * s) * a;  // a Newton step on the vectors themselves
  const double rising = at.dot(v + s * a);
  if (rising > 0) {
    const double correction = 0.5 * (at.squaredNorm() - range * range) / rising;
    if (std::abs(correction) < 1e-6 * s) s -= correction;
  }
  return s < time_left ? s : kNever;
}

/// A sphere and a wall: gap + v s + a s²/2, v and a along the wall's inward normal, s in [0, time_left).
inline double wall_contact_time(double gap, double v, double a, double time_left, bool touching, double slack) {
  if (!(gap < kNever)) return kNever;
  if (touching) {
    if (v < -slack) return 0;
    if (a >= 0) return kNever;
    const double s = v <= slack ? 0.0 : -2 * v / a;
    return s < time_left ? s : kNever;
  }
  if (a == 0) {
    const double s = v < 0 ? gap / -v : kNever;
    return s < time_left ? s : kNever;
  }
  return first_fall(Polynomial<2>{{gap, v, 0.5 * a}}, time_left);
}

/// A sphere that is not wholly in front of a one-way wall: the time at which it comes back after it has passed.
/// `clearance` < 0 is the distance of its surface from the plane, v and a as above.
inline double return_time(double clearance, double v, double a, double time_left) {
  const double discriminant = v * v - 2 * a * clearance;
  if (v <= 0 || a >= 0 || discriminant <= 0) return kNever;
  const double s = (v + std::sqrt(discriminant)) / -a;
  return s < time_left ? s : kNever;
}

}  // namespace carom
