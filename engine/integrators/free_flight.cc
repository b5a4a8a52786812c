// free-flight: no forces but a uniform field, exact from event to event.
//
// The slab is an epoch: at its end all records are flown to one time and wrapped, so that times stay small and their
// last digits fine. Between events x(t) = x + v s + ½ g s² holds exactly; there is no step and no truncation error.

#include <optional>

#include "engine/base/error.h"
#include "engine/events/event_core.h"
#include "engine/integrators/registry.h"
#include "engine/ranks/domains.h"

namespace carom::integrator {
namespace {

template <int D>
class FreeFlight : public Integrator<D> {
 public:
  explicit FreeFlight(const Parameters& parameters)
      : max_events_(static_cast<std::uint64_t>(parameters.integer("max_events_per_step"))) {}

  void start(System<D>& system, Counters&) override {
    if (system.ranks) ranks_ = system.ranks;
    if (ranks_->size() > 1)
      domains_.emplace(system.box, system.sizes ? *system.sizes : Sizes(system.particles), *ranks_);
    else
      core_.emplace(system.box, system.particles);
    for (const auto& term : system.interactions) {
      if (!term->common_acceleration())
        throw Error(Failure::deck, "free-flight knows no forces but a uniform-field; use psa, cva, mcva or cdda");
      g_ += *term->common_acceleration();
    }
  }

  void slab(System<D>& system, const Slab& slab, SlabReport<D>& report) override {
    if (core_)
      run_epoch(*core_, system, slab, report);
    else
      run_epoch(*domains_, system, slab, report);
  }

 private:
  /// `flight`: an EventCore, or Domains.
  template <class Flight>
  void run_epoch(Flight& flight, System<D>& system, const Slab& slab, SlabReport<D>& report) {
    const typename EventCore<D>::Report events{report.counters, report.contacts, slab.collision_limit,
                                               max_events_ * system.size()};
    const auto run = [&](double end) {
      auto& seconds = report.counters.seconds;
      const Stopwatch watch(seconds.queue);
      const double before = seconds_waited();
      const double reached = flight.run(end, events);
      seconds.communicate += seconds_waited() - before;
      return reached;
    };
    {
      const Stopwatch watch(report.counters.seconds.predict);
      flight.take(system.particles, g_, slab.length);
    }
    const Box<D> start = system.box;
    const auto end_at = [&](double time) {
      flight.give_back(time, system.particles);
      system.box = start.after(time);
    };
    try {
      report.reached = slab.length;
      for (double due : report.observe) {
        report.reached = run(due);
        if (report.reached < due) break;
        if (copies_.mass.empty()) copies_ = system.particles;
        flight.fly_to(due, copies_);
        copies_.image = system.particles.image;
        for (std::size_t i = 0; i < copies_.size(); ++i) system.box.wrap(copies_.x[i], copies_.image[i]);
        system.box = start.after(due);
        report.observer(due, copies_);
        system.box = start;
      }
      if (report.observe.empty() || report.reached == report.observe.back()) report.reached = run(slab.length);
    } catch (...) {
      if (ranks_->size() == 1) end_at(flight.now());
      throw;
    }
    end_at(report.reached);
    report.counters.events = flight.counts();
    if (domains_) report.counters.domains = domains_->domain_counts();
    system.wrap();
  }

  double seconds_waited() const { return domains_ ? domains_->seconds_waited() : 0; }

  std::uint64_t max_events_;
  Vec<D> g_ = Vec<D>::Zero();
  Exchange alone_;
  Exchange* ranks_ = &alone_;
  std::optional<EventCore<D>> core_;  // one of the two
  std::optional<Domains<D>> domains_;
  Particles<D> copies_;
};

}  // namespace

IntegratorInfo free_flight() {
  Parameter epoch = parameter::step();
  epoch.fallback = "none";
  epoch.meaning =
      "length of an epoch, after which all particles are brought to one time; about forty mean free times where it is "
      "absent";
  Parameter limit = parameter::max_events_per_step();
  limit.meaning = "collisions that one epoch may need, per particle, before the run ends with an error";
  return {
      .name = "free-flight",
      .title = "Event-driven hard spheres",
      .order = "exact",
      .conserves = "energy and linear momentum, to rounding",
      .parameters = {epoch, limit},
      .documentation =
          "Exact flight between elastic collisions, for hard spheres without forces or in a uniform field. There is "
          "no time step: the trajectory is exact but for rounding. `step` is only the length of an epoch.",
      .source =
          "Alder, Wainwright, J. Chem. Phys. 31 (1959) 459; Rapaport, J. Comput. Phys. 34 (1980) 184; "
          "Lubachevsky, J. Comput. Phys. 94 (1991) 255",
      .stepping = false,
      .smooth_forces = false,
      .in_2d = make<FreeFlight, 2>,
      .in_3d = make<FreeFlight, 3>};
}

}  // namespace carom::integrator
