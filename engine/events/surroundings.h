// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The time until which the neighbourhood found for a sphere is valid: it leaves the region of its list, or its cell.
// For lists this is a lower bound; it is never too late.

#include <cmath>

#include "engine/events/contact.h"
#include "engine/events/flights.h"
#include "engine/laws/box.h"
#include "engine/search/flow_frame.h"
#include "engine/search/linked_cells.h"
#include "engine/search/next_event.h"

namespace carom {

/// Sets a.update to a time before which a sphere with this record stays in the region of its list, a ball of radius
/// `skin` that moves with the flow. Its contact must have been planned.
template <int D>
void predict_leaving(NextEvent<D>& a, const Record<D>& r, const Flights<D>& flights, const FlowFrame& flow, double skin,
                     double now) {
  Vec<D> e;
  for (int k = 0; k < D; ++k) e[k] = r.x[k] - a.where.centre[k];
  skin *= 1 - 1e-6;
  Vec<D> v = r.v;
  if (flow.rate != 0) [[unlikely]] {
    const double speed = flow.rate * a.where.centre[1];
    e[0] -= speed * (r.t - flow.time);
    v[0] -= speed;
  }
  if (!flights.field()) {
    if (a.contact < kNever && (e + (a.contact - r.t) * v).squaredNorm() < skin * skin) {
      a.update = kNever;  // not before its contact: a segment between two points of a ball stays in it
      return;
    }
    // |e + v s| = skin; the form with cancellation is accurate enough for a bound
    const double b = e.dot(v), v_squared = v.squaredNorm(), room = skin * skin - e.squaredNorm();
    const double s = (std::sqrt(std::max(b * b + v_squared * room, 0.0)) - b) / v_squared;
    a.update = v_squared > 0 ? std::max(r.t + s, now) : kNever;
    return;
  }
  // A sphere moves at most |v| s + |g| s²/2 from where it is at `now`.
  const double s0 = now - r.t;
  e += s0 * v + (0.5 * s0 * s0) * flights.g();
  const double speed = (v + s0 * flights.g()).norm(), room = std::max(skin - e.norm(), 0.0);
  a.update = std::max(now + 2 * room / (speed + std::sqrt(speed * speed + 2 * flights.g().norm() * room)), now);
}

/// predict_crossing() with a field.
template <int D>
[[gnu::noinline]] void predict_crossing_in_field(NextEvent<D>& a, Slot i, const Flights<D>& flights, const Box<D>& box,
                                                 const CellGrid<D>& grid, double now) {
  const Record<D> r = flights.at(i, now);
  a.update = kNever;
  for (int k = 0; k < D; ++k)
    for (int side = 0; side < 2; ++side) {
      const std::int32_t c = a.where.cell.unwrapped[k] + side;
      if (!box.periodic(k) && (c <= 0 || c >= grid.count(k))) continue;  // the outermost cells have no outer face
      const double outward = side == 1 ? 1.0 : -1.0;
      const double gap = outward * (grid.face(k, c) - r.x[k]);  // distance to the face, ≥ 0 up to rounding
      const double s = wall_contact_time(std::max(gap, 0.0), -outward * r.v[k], -outward * flights.g()[k],
                                         flights.horizon() - now, false, 0.0);
      // At least one ulp after now: at the top of its path a particle could otherwise cross back and forth at the same
      // time.
      const double t = std::max(now + s, std::nextafter(now, kNever));
      if (t < a.update) {
        a.update = t;
        a.face = static_cast<std::uint8_t>(2 * k + side);
      }
    }
}

/// Sets a.update and a.face to the time at which sphere i leaves its cell and the face it crosses.
template <int D>
void predict_crossing(NextEvent<D>& a, Slot i, const Flights<D>& flights, const Box<D>& box,
                      const LinkedCells<D>& cells, double now) {
  if (flights.field()) return predict_crossing_in_field(a, i, flights, box, cells.grid(), now);
  const Record<D>& r = flights[i];
  const Crossing next = cells.crossing(r, a.where.cell);
  a.update = std::max(r.t + next.after, now);
  a.face = static_cast<std::uint8_t>(next.face);
}

}  // namespace carom
