// SPDX-License-Identifier: BSD-3-Clause
// free-flight: no forces but a uniform field, exact from event to event.
//
// The slab is an epoch: at its end all records are flown to one time and wrapped, so that times stay small and their
// last digits fine. Between events x(t) = x + v s + ½ g s² holds exactly; there is no step and no truncation error.
// Within an epoch it can leave off with the records as state: plans are pure functions of them.

#include <optional>

#include "engine/base/error.h"
#include "engine/events/event_core.h"
#include "engine/integrators/registry.h"
#include "engine/ranks/windowed_flight.h"
#include "engine/setup/epoch.h"

namespace carom::integrator {
namespace {

template <int D>
class FreeFlight : public Integrator<D> {
 public:
  explicit FreeFlight(const Parameters& parameters)
      : max_events_(static_cast<std::uint64_t>(parameters.integer("max_events_per_step"))) {}

  void start(System<D>& system, Counters&) override {
    between_looks_ = kCollisionsBetweenLooks / (20 * static_cast<double>(system.size())) * default_epoch(system);
    ranks_ = &system.decomposition.ranks();
    if (ranks_->size() > 1)
      windowed_.emplace(system.box, system.decomposition.sizes(), *ranks_);
    else
      core_.emplace(system.box, system.particles);
    system.fields.add("time of last event", instants_.t);
    system.fields.add("generation", instants_.generation);
    system.fields.add_value("epoch time", instants_.now);
    system.fields.add_value("within epoch", within_);
    for (const auto& term : system.interactions) {
      if (!term->common_acceleration())
        throw Error(Failure::deck, "free-flight knows no forces but a uniform-field; use psa, cva, mcva or cdda");
      g_ += *term->common_acceleration();
    }
  }

  void slab(System<D>& system, const Slab& slab, SlabReport<D>& report) override {
    if (windowed_)
      run_epoch(*windowed_, system, slab, report);
    else if (within_ && !loaded_)
      run_epoch(resumed_.emplace(system.box, Sizes(system.particles), *ranks_), system, slab, report);
    else if (resumed_)
      run_epoch(*resumed_, system, slab, report);
    else
      run_epoch(*core_, system, slab, report);
  }

  double paused_at() const override { return instants_.now; }

 private:
  /// About as many collisions are run between looks at SlabReport::pause.
  static constexpr double kCollisionsBetweenLooks = 5e5;

  /// `flight`: an EventCore, or WindowedFlight.
  template <class Flight>
  void run_epoch(Flight& flight, System<D>& system, const Slab& slab, SlabReport<D>& report) {
    const typename EventCore<D>::Report events{report.counters, report.contacts, slab.collision_limit,
                                               max_events_ * system.size()};
    begin(flight, system, slab, report.counters);
    at_limit_ = report.counters.sphere_sphere >= slab.collision_limit;
    // Flies to `end`, or as far as it comes; false: not to its end, or paused there.
    const auto run = [&](double end) {
      const Stopwatch watch(report.counters.seconds.queue);
      while (!at_limit_ && !report.paused && instants_.now < end) {
        const double next = report.pause ? std::min(end, instants_.now + between_looks_) : end;
        instants_.now = flight.run(next, events);
        at_limit_ = instants_.now < next;
        if (report.pause && instants_.now < slab.length) report.paused = at_limit_ || report.pause();
      }
      return instants_.now == end && !report.paused;
    };
    const Box<D> start = system.box;
    const auto end_at = [&](double time) {
      flight.give_back(time, system.particles);
      system.box = start.after(time);
    };
    try {
      bool all = true;
      for (double due : report.observe) {
        all = all && run(due);
        if (!all) break;
        if (copies_.mass.empty()) copies_ = system.particles;
        flight.fly_to(due, copies_);
        copies_.image = system.particles.image;
        for (std::size_t i = 0; i < copies_.size(); ++i) system.box.wrap(copies_.x[i], copies_.image[i]);
        system.box = start.after(due);
        report.observer(due, copies_);
        system.box = start;
      }
      if (all) run(slab.length);
    } catch (...) {
      if (ranks_->size() == 1) end_at(flight.now());
      throw;
    }
    if (report.paused) return leave_off(flight, system.particles);
    report.reached = instants_.now;
    end_at(report.reached);
    within_ = loaded_ = at_limit_ = false;
    instants_ = {};
    report.counters.events = flight.counts();
    if (windowed_) report.counters.windows = windowed_->window_counts();
    resumed_.reset();
    system.wrap();
  }

  /// Gives the flight the particles, those of an epoch that was left off as they were.
  template <class Flight>
  void begin(Flight& flight, System<D>& system, const Slab& slab, Counters& counters) {
    const Stopwatch watch(counters.seconds.predict);
    Particles<D>& p = system.particles;
    if (!within_) {
      instants_ = {};
      flight.take(p, g_, slab.length);
    } else if (loaded_) {
      std::vector<Vec<D>>().swap(p.x);
      std::vector<Vec<D>>().swap(p.v);
    } else if constexpr (requires { flight.go_on(p, g_, slab.length, instants_); }) {
      flight.go_on(p, g_, slab.length, instants_);
    }
    within_ = loaded_ = true;
  }

  /// Writes the records into the state of the run, for a checkpoint; the flight has them still.
  template <class Flight>
  void leave_off(const Flight& flight, Particles<D>& p) {
    if constexpr (requires { flight.records(p, instants_); }) {
      flight.records(p, instants_);
    } else {
      const std::size_t n = p.mass.size();
      for (auto* each : {&p.x, &p.v}) each->resize(n);
      instants_.t.resize(n);
      instants_.generation.resize(n);
      for (const Record<D>& r : flight.flights().records()) {
        p.x[r.id] = r.x;
        p.v[r.id] = r.v;
        instants_.t[r.id] = r.t;
        instants_.generation[r.id] = r.generation;
      }
    }
  }

  std::uint64_t max_events_;
  double between_looks_ = 0;  // [time]
  Vec<D> g_ = Vec<D>::Zero();
  Communicator* ranks_ = nullptr;
  std::optional<EventCore<D>> core_;  // one of the two
  std::optional<WindowedFlight<D>> windowed_;
  std::optional<WindowedFlight<D>> resumed_;  // one rank: for the rest of an epoch that was left off in another process
  bool within_ = false;                       // an epoch that was left off
  bool loaded_ = false;                       // the flights of that epoch are here
  bool at_limit_ = false;                     // of collisions
  Instants instants_;
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
      .exact = true,
      .in_2d = make<FreeFlight, 2>,
      .in_3d = make<FreeFlight, 3>};
}

}  // namespace carom::integrator
