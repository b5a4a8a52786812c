// SPDX-License-Identifier: BSD-3-Clause
// psa: K(h/2), then the drift D(h) resolved event by event, then K(h/2).

#include <optional>

#include "engine/events/meeting.h"
#include "engine/integrators/flow.h"
#include "engine/integrators/registry.h"
#include "engine/stepping/slab_core.h"

namespace carom::integrator {
namespace {

template <int D>
class PrimitiveSplitting : public Integrator<D> {
 public:
  explicit PrimitiveSplitting(const Parameters& parameters)
      : max_events_(static_cast<std::uint64_t>(parameters.integer("max_events_per_step"))) {}

  void start(System<D>& system, Counters& counters) override {
    core_.emplace(system, max_events_);
    system.box.straight = true;
    accelerations_.start(system, counters);
  }

  const PotentialSums* potential() const override { return &accelerations_.sums; }
  Positions<D> accelerations() const override { return accelerations_.a; }

  void slab(System<D>& system, const Slab& slab, SlabReport<D>& report) override {
    auto& p = system.particles;
    core_->begin_step(report.counters, report.contacts, &accelerations_.a, slab.length, report.watch);
    if (!system.box.contacts.elastic()) {
      const std::vector<Vec<D>> before = p.v;
      try {
        inelastic_slab(system, slab.length, report);
        system.wrap();
      } catch (const HaloTooSmall&) {  // only the first kick has changed anything
        p.v = before;
        throw;
      }
    } else {
      kicked_ = p.v;
      FlowOfStep<D> flow(system, kicked_, accelerations_);
      kick(kicked_, accelerations_.a, 0.5 * slab.length);
      core_->begin(kicked_, {}, slab.length);
      core_->fly({});
      core_->commit(0);
      core_->finish(p);
      system.decomposition.update_halo();
      accelerations_.update(system, report.counters);
      kick(p.v, accelerations_.a, 0.5 * slab.length);
      flow.leave(slab.length, accelerations_, report.counters);
    }
    report.reached = slab.length;
  }

 private:
  /// A slab with inelastic contacts: the drift is cut where a slow contact stops or a resting one is hit. There the
  /// velocities have been kicked for the time that has passed, and are kicked for half of the rest: with the whole
  /// first kick, contacts that meet early would take more energy from it than the fall gives, and a pile would never
  /// rest. The kicks do not make resting contacts approach.
  void inelastic_slab(System<D>& system, double length, SlabReport<D>& report) {
    auto& p = system.particles;
    auto& scan = core_->scan();
    scan.rest().stop_within(length);
    double done = 0, kicked = 0;
    const auto begin_drift = [&] {
      if (done > 0) kick(p.v, accelerations_.a, done - kicked);
      resolve_contacts(system, done);
      const double half = 0.5 * (length - done);
      kick(p.v, accelerations_.a, half);
      kicked = done + half;
      if (!scan.resting().empty()) scan.stop_approach(p.x, p.v, half);
      return resolve_contacts(system, done);
    };
    bool touching = begin_drift();
    for (double contact = kNever; done < length;) {
      const double time_left = length - done, piece = std::min(time_left, contact);
      kicked_ = p.v;
      core_->begin(kicked_, {}, piece, touching);
      const FlightEnd<D> end = core_->fly({});
      if (!end.complete) {
        system.decomposition.need_all();
        scan.count_event(end.key);
        contact = end.time > 0 ? end.time : kNever;
        if (contact == kNever) touching = resolve_contacts(system, done);
        continue;
      }
      core_->commit(done);
      core_->finish(p);
      done = piece == time_left ? length : done + piece;
      contact = kNever;
      if (done < length) touching = begin_drift();
    }
    system.decomposition.update_halo();
    accelerations_.update(system, report.counters);
    kick(p.v, accelerations_.a, length - kicked);
    scan.drop_open(p.x);
    if (!scan.resting().empty()) scan.stop_approach(p.x, p.v, length - kicked);
    scan.remember(0);
  }

  /// Resolves the contacts at the present positions; returns whether any contact approached or rests. Collective.
  bool resolve_contacts(System<D>& system, double time) {
    auto& p = system.particles;
    auto& scan = core_->scan();
    if (!system.decomposition.any(scan.find_contacts(time, p.x, p.v))) return false;
    system.decomposition.need_all();
    scan.resolve(time, p.x, p.v, [&](const Touch<D>& touch) {
      return resolve_contact<D>(touch.key, touch.normal, system.box, p, touch.tether);
    });
    return true;
  }

  std::uint64_t max_events_;
  std::optional<SlabCore<D>> core_;
  Accelerations<D> accelerations_;
  std::vector<Vec<D>> kicked_;  // velocities after the first kick
};

}  // namespace

IntegratorInfo psa() {
  return {.name = "psa",
          .title = "Primitive Splitting Algorithm",
          .order = "1",
          .conserves = "linear momentum to rounding; energy to order 1, with an error at each collision",
          .parameters = {parameter::step(), parameter::longest_step(), parameter::max_events_per_step()},
          .documentation =
              "Verlet with a drift that resolves each collision: half a kick, free flight with all its "
              "collisions, half a kick. The velocities at a collision lack the second half of the kick, so the "
              "method is of first order. It is the cheapest one.",
          .source = "Suh, Mier-y-Teran, White, Davis, Chem. Phys. 142 (1990) 203",
          .local = true,
          .shadow = true,
          .steps = true,
          .shear = true,
          .in_2d = make<PrimitiveSplitting, 2>,
          .in_3d = make<PrimitiveSplitting, 3>};
}

}  // namespace carom::integrator
