// psa: K(h/2), then the drift D(h) resolved event by event, then K(h/2).

#include <optional>

#include "engine/event_core.h"
#include "engine/integrators/kicks.h"
#include "engine/integrators/registry.h"

namespace carom::integrator {
namespace {

template <int D>
class PrimitiveSplitting : public Integrator<D> {
 public:
  explicit PrimitiveSplitting(const Parameters& parameters)
      : max_events_(static_cast<std::uint64_t>(parameters.integer("max_events_per_step"))) {}

  void start(System<D>& system, Counters& counters) override {
    core_.emplace(system.box, system.particles);
    accelerations_.update(system, counters);
  }

  void slab(System<D>& system, const Slab& slab, SlabReport<D>& report) override {
    auto& p = system.particles;
    kick(p, accelerations_.a, 0.5 * slab.length);
    {
      const Stopwatch watch(report.counters.seconds.predict);
      core_->load(p, Vec<D>::Zero(), slab.length);
    }
    {
      const Stopwatch watch(report.counters.seconds.queue);
      core_->run(slab.length, {.counters = report.counters, .contacts = report.contacts, .max_events = max_events_});
    }
    core_->fly_to(slab.length, p);
    report.counters.events = core_->counts();
    accelerations_.update(system, report.counters);
    kick(p, accelerations_.a, 0.5 * slab.length);
    system.wrap();
    report.reached = slab.length;
  }

 private:
  std::uint64_t max_events_;
  std::optional<EventCore<D>> core_;
  Accelerations<D> accelerations_;
};

}  // namespace

IntegratorInfo psa() {
  return {.name = "psa",
          .title = "Primitive Splitting Algorithm",
          .order = "1",
          .conserves = "linear momentum to rounding; energy to order 1, lost at collisions",
          .parameters = {parameter::step(), parameter::max_events_per_step()},
          .documentation =
              "Verlet whose drift is resolved event by event: half a kick, free flight with all its "
              "collisions, half a kick. Collisions see velocities that lack the force of the step's other "
              "half: first order, and the cheapest.",
          .source = "Suh, Mier-y-Teran, White, Davis, Chem. Phys. 142 (1990) 203",
          .shadow = true,
          .in_2d = make<PrimitiveSplitting, 2>,
          .in_3d = make<PrimitiveSplitting, 3>};
}

}  // namespace carom::integrator
