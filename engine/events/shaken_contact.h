// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The time at which a sphere touches a wall that moves on a sine.

namespace carom {

/// The gap is y + v s + a s²/2 − amplitude·sin(2π(turns + frequency·s)) for s in [0, time_left); y, v, a are distance,
/// velocity and acceleration of the surface of the sphere along the normal of the wall, relative to the centre of the
/// sine. Returns the first time at which the gap is not positive and decreasing; infinite if there is none before
/// `time_left`. `touching` and `slack` as in wall_contact_time(), contact.h.
struct ShakenGap {
  double y, v, a;
  double amplitude, frequency, turns;

  double first_contact(double time_left, bool touching, double slack) const;
  double at(double s) const;
  double slope(double s) const;
};

}  // namespace carom
