// SPDX-License-Identifier: BSD-3-Clause
// cva: the whole step is cut at each collision: K(τ/2) D(τ) K(τ/2), collide, continue with the remaining h − τ.

#include <optional>

#include "engine/events/meeting.h"
#include "engine/integrators/collision_verlet.h"
#include "engine/integrators/registry.h"

namespace carom::integrator {
namespace {

template <int D>
class CollisionVerlet : public Integrator<D> {
 public:
  explicit CollisionVerlet(const Parameters& parameters)
      : max_events_(static_cast<std::uint64_t>(parameters.integer("max_events_per_step"))) {}

  void start(System<D>& system, Counters& counters) override {
    pieces_.emplace(system, max_events_);
    pieces_->start(counters);
  }

  const PotentialSums* potential() const override { return &pieces_->potential(); }
  Positions<D> accelerations() const override { return pieces_->a(); }

  void slab(System<D>& system, const Slab& slab, SlabReport<D>& report) override {
    pieces_->begin_step(report, slab.length);
    double done = 0;
    for (bool contact = true; contact;) {
      pieces_->collide(done, [&](const Touch<D>& touch) {
        return resolve_contact<D>(touch.key, touch.normal, system.box, system.particles);
      });
      const double time_left = slab.length - done, tau = pieces_->next_contact(time_left);
      contact = tau < time_left;
      pieces_->advance(contact ? tau : time_left);
      done += tau;
    }
    system.wrap();
    report.reached = slab.length;
  }

 private:
  std::uint64_t max_events_;
  std::optional<VerletPieces<D>> pieces_;
};

}  // namespace

IntegratorInfo cva() {
  return {.name = "cva",
          .title = "Collision Verlet Algorithm",
          .order = "2",
          .conserves = "linear momentum to rounding; energy to order 2, with a random walk from collision to collision",
          .parameters = {parameter::step(), parameter::longest_step(), parameter::max_events_per_step()},
          .documentation =
              "Verlet with a step that is cut for all particles at each collision. Between collisions spheres "
              "move on parabolas, so the contact is the first root of a quartic. Each collision costs a "
              "whole force pass.",
          .source = "Houndonougbo, Laird, Leimkuhler, Mol. Phys. 98 (2000) 309",
          .shadow = true,
          .in_2d = make<CollisionVerlet, 2>,
          .in_3d = make<CollisionVerlet, 3>};
}

}  // namespace carom::integrator
