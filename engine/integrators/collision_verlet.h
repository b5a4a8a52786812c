// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Kick-drift-kick pieces that end at contacts, for cva and mcva.
//
// A piece that starts at (x, v) with a = −M⁻¹∇V(x) carries every particle along x + v s + ½ a s² and ends exactly
// there, whatever its length; so the first contact on the parabolas limits the length of the piece.

#include <algorithm>

#include "engine/integrators/integrator.h"
#include "engine/integrators/kicks.h"
#include "engine/stepping/contact_scan.h"

namespace carom::integrator {

template <int D>
class VerletPieces {
 public:
  VerletPieces(System<D>& system, std::uint64_t max_events) : system_(system), scan_(system, max_events, reactions_) {
    scan_.rest().let_open();
  }

  void start(Counters& counters) {
    accelerations_.start(system_, counters);
    system_.fields.add_value("reactions", reactions_);
  }

  void begin_step(SlabReport<D>& report, double length) {
    counters_ = &report.counters;
    watch_ = report.watch;
    scan_.begin_step(report.counters, report.contacts, &accelerations_.a, length, watch_);
  }

  /// Applies the impulse to all contacts that approach; see ContactScan::resolve.
  void collide(double time, const ApplyImpulse<D>& impulse) {
    scan_.resolve(time, system_.particles.x, system_.particles.v, impulse);
  }

  /// The time until the first contact, at most `time_left`. Sets the accelerations of the piece: a plus the reactions
  /// of resting contacts.
  double next_contact(double time_left) {
    flight_ = accelerations_.a;
    if (!scan_.resting().empty()) scan_.hold(system_.particles.v, flight_, time_left);
    const double contact = scan_.earliest(system_.particles.x, system_.particles.v, flight_, time_left).key.time;
    if (contact < time_left && watch_) watch_->before_change();
    return std::min(time_left, contact);
  }

  /// K(τ/2) D(τ) K(τ/2). Call next_contact() first.
  void advance(double tau) {
    auto& p = system_.particles;
    for (std::size_t i = 0; i < p.size(); ++i) {
      p.v[i] += (0.5 * tau) * flight_[i];
      p.x[i] += tau * p.v[i];
    }
    accelerations_.update(system_, *counters_);
    kick(p.v, accelerations_.a, 0.5 * tau);
    scan_.remember(0.5 * tau);  // the first kick has the reactions; stop_approach() does in place of the second
    system_.box.time += tau;
    if (!scan_.resting().empty()) scan_.stop_approach(p.x, p.v);
  }

  /// −M⁻¹∇V at the present positions.
  const std::vector<Vec<D>>& a() const { return accelerations_.a; }
  const PotentialSums& potential() const { return accelerations_.sums; }
  /// The accelerations of the piece, set by next_contact().
  const std::vector<Vec<D>>& flight() const { return flight_; }

 private:
  System<D>& system_;
  std::vector<Reaction<D>> reactions_;
  ContactScan<D> scan_;
  Accelerations<D> accelerations_;
  std::vector<Vec<D>> flight_;
  Counters* counters_ = nullptr;
  SlabWatch* watch_ = nullptr;
};

}  // namespace carom::integrator
