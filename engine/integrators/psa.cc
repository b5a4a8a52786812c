// psa: K(h/2), then the drift D(h) resolved event by event, then K(h/2).

#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/event_core.h"
#include "engine/integrators/digest.h"
#include "engine/integrators/kicks.h"
#include "engine/integrators/registry.h"
#include "engine/shared_contacts.h"

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

  const PotentialSums* potential() const override { return &accelerations_.sums; }
  bool local() const override { return true; }
  void pack(Id i, Bytes& to) const override { accelerations_.pack(i, to); }
  void unpack(Id i, Reader& from) override { accelerations_.unpack(i, from); }
  void release() override { core_.reset(); }
  void regroup(System<D>& system) override {
    core_.emplace(system.box, system.particles);
    accelerations_.a.resize(system.particles.size());
  }

  void slab(System<D>& system, const Slab& slab, SlabReport<D>& report) override {
    auto& p = system.particles;
    const bool some = system.part && !system.part->knows_everybody();
    if (some) before_ = p.v;
    kick(p, accelerations_.a, 0.5 * slab.length);
    {
      const Stopwatch watch(report.counters.seconds.predict);
      core_->load(p, Vec<D>::Zero(), slab.length);
    }
    if (!some) {
      run(slab.length, report.counters, report.contacts);
    } else if (!run_some(system, slab.length, report)) {
      p.v.swap(before_);
      report.unsure = true;
      return;
    }
    core_->fly_to(slab.length, p);
    report.counters.events = core_->counts();
    if (some) system.part->refresh(p.x), system.part->refresh(p.v);
    accelerations_.update(system, report.counters);
    kick(p, accelerations_.a, 0.5 * slab.length);
    system.wrap();
    report.reached = slab.length;
  }

 private:
  void run(double length, Counters& counters, std::vector<Contact<D>>* contacts) {
    const Stopwatch watch(counters.seconds.queue);
    core_->run(length, {.counters = counters, .contacts = contacts, .max_events = max_events_});
  }

  /// Of the particles that this rank knows; false where more would have to be known.
  bool run_some(const System<D>& system, double length, SlabReport<D>& report) {
    Counters all;  // the ghosts' contacts among them
    std::vector<Contact<D>> contacts;
    run(length, all, &contacts);
    report.counters.seconds.queue += all.seconds.queue;
    const auto& p = system.particles;
    Digest<D> events(p);
    double squared_speed = 0;
    std::vector<Vec<D>> v = p.v;  // on the way
    const auto kick = [&](Id i, const Vec<D>& impulse) {
      v[i] += impulse / p.mass[i];
      squared_speed = std::max(squared_speed, v[i].squaredNorm());
    };
    for (Id i = 0; i < p.size(); ++i) kick(i, Vec<D>::Zero());
    for (const Contact<D>& contact : contacts) {
      events.add(contact.key);
      kick(contact.key.lo, contact.impulse);
      if (contact.key.kind == EventKind::pair) kick(contact.key.hi, -contact.impulse);
    }
    Part<D>& part = *system.part;
    bool agreed = true;
    part.tell(
        [&](Id i, Bytes& to) { put(to, events[i]); },
        [&](Id i, Reader& from) { agreed = (from.get<std::uint64_t>() == events[i] || !part.matters(i)) && agreed; });
    if (part.largest(agreed ? 0 : 1) > 0) {
      part.deepen();
      return false;
    }
    return part.covers(1.001 * length * std::sqrt(squared_speed)) &&
           commit_contacts<D>(system, contacts, max_events_, report.counters, report.contacts);
  }

  std::uint64_t max_events_;
  std::optional<EventCore<D>> core_;
  Accelerations<D> accelerations_;
  std::vector<Vec<D>> before_;  // velocities at the start of the slab
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
