// SPDX-License-Identifier: BSD-3-Clause
// free-flight: no forces except a uniform field; exact from event to event.
//
// The slab is an epoch: at its end all records are moved to one time and wrapped, so that times stay small and keep
// their last digits. Between events x(t) = x + v s + ½ g s² holds exactly; there is no step and no truncation error.
//
// In a sheared box the event core has velocities in the laboratory during a slab (flow.h).

#include <algorithm>
#include <optional>

#include "engine/base/error.h"
#include "engine/events/event_core.h"
#include "engine/integrators/flow.h"
#include "engine/integrators/registry.h"
#include "engine/ranks/windowed_flight.h"

namespace carom::integrator {
namespace {

template <int D>
class FreeFlight : public Integrator<D> {
 public:
  explicit FreeFlight(const Parameters& parameters)
      : max_events_(static_cast<std::uint64_t>(parameters.integer("max_events_per_step"))) {
    if (const bool* given = parameters.find<bool>("lengthen")) lengthens_ = *given;
  }

  bool lengthens() const override { return lengthens_; }

  void start(System<D>& system, Counters&) override {
    Communicator& ranks = system.decomposition.ranks();
    if (ranks.size() > 1)
      windowed_.emplace(system.box, system.decomposition.sizes(), ranks);
    else
      core_.emplace(system.box);
    for (const auto& term : system.interactions) g_ += *term->common_acceleration();  // refusal() takes no others
  }

  void slab(System<D>& system, const Slab& slab, SlabReport<D>& report) override {
    if (slab.index != epoch_) epoch_ = slab.index, contacts_ = 0;
    const std::uint64_t before = report.counters.contacts(), most = max_events_ * system.size();
    if (contacts_ > most) throw_too_many_contacts(system.box.contacts, most);
    if (windowed_) {
      fly(*windowed_, system, slab, report, most);
      report.counters.windows = windowed_->window_counts();
    } else {
      fly(*core_, system, slab, report, most);
    }
    contacts_ += report.counters.contacts() - before;
  }

 private:
  /// `flight` is an EventCore or a WindowedFlight.
  template <class Flight>
  void fly(Flight& flight, System<D>& system, const Slab& slab, SlabReport<D>& report, std::uint64_t most) {
    const double start = system.box.time, tilt = system.box.tilt;
    // Moves the box, and keeps unwrapped positions where the tilt is made shorter.
    const auto move_to = [&](double elapsed, Particles<D>& particles) {
      renumber_images(particles, system.box.pass(start, tilt, elapsed));
    };
    {
      const Stopwatch watch(report.counters.seconds.predict);
      join(system, system.particles, 1, report.counters);
      flight.take(system.particles, g_, slab.length);
    }
    const auto end_at = [&](double reached) {
      flight.give_back(reached, system.particles);
      join(system, system.particles, -1, report.counters);
      move_to(reached, system.particles);
    };
    const auto events = [&] { return report.counters.contacts() + report.counters.kicks; };
    const std::uint64_t before = events();
    // Runs to `end` or to a limit; returns whether it reached `end` and no limit: the last contact may be at `end`.
    const auto run = [&](double end) {
      const Stopwatch watch(report.counters.seconds.queue);
      report.reached = flight.run(end, {.counters = report.counters,
                                        .contacts = report.contacts,
                                        .collision_limit = slab.collision_limit,
                                        .max_events = most,
                                        .contact_limit = slab.contact_limit});
      return report.reached == end && report.counters.sphere_sphere < slab.collision_limit &&
             events() - before < slab.contact_limit;
    };
    const auto observe = [&](double due) {
      if (!run(due)) return false;
      if (copies_.mass.empty()) copies_ = system.particles;
      flight.copy_at(due, copies_);
      copies_.image = system.particles.image;
      join(system, copies_, -1, report.counters);
      move_to(due, copies_);
      for (std::size_t i = 0; i < copies_.size(); ++i) system.box.wrap(copies_.x[i], copies_.image[i]);
      report.observer(due, copies_);
      system.box.pass(start, tilt, 0);
      if (system.box.sheared()) report.counters.shear.add(start_again_);  // the flight goes on
      return true;
    };
    try {
      if (std::ranges::all_of(report.observe, observe)) run(slab.length);
    } catch (...) {
      if (!windowed_) end_at(flight.now());  // so that messages can name positions; with ranks it would be collective
      throw;
    }
    end_at(report.reached);
    report.counters.events = flight.counts();
    report.boxes = 0;
    for (int k = 0; k < D; ++k)
      if (const double edge = system.box.edges[k]; system.box.periodic(k))
        for (const Vec<D>& x : system.particles.x)
          report.boxes = std::max({report.boxes, x[k] / edge - 1, -x[k] / edge});
    system.wrap();
  }

  /// Changes velocities from one frame to the other (FlowEnergy), and books the energy that the flow gave in flight.
  void join(const System<D>& system, Particles<D>& particles, double sign, Counters& counters) {
    start_again_ = {};
    if (system.box.shear_rate == 0) return;
    FlowEnergy<D> energy;
    energy.join(system, particles.x, particles.v, sign);
    const FlowEnergy<D> of_all = system.decomposition.sum(energy);
    counters.shear.add(of_all.booked);
    start_again_ = of_all.undone;
  }

  std::uint64_t max_events_;
  bool lengthens_ = false;
  Vec<D> g_ = Vec<D>::Zero();
  std::optional<EventCore<D>> core_;  // one of these two is used
  std::optional<WindowedFlight<D>> windowed_;
  std::int64_t epoch_ = -1;
  std::uint64_t contacts_ = 0;  // of the present epoch in its earlier slabs
  Particles<D> copies_;
  ExactSum start_again_;  // undoes what the last join() has booked
};

}  // namespace

IntegratorInfo free_flight() {
  Parameter epoch = parameter::step();
  epoch.fallback = "none";
  epoch.meaning =
      "length of an epoch, after which all particles are moved to the same time; default: about forty mean free times, "
      "but at most the time in which a sphere flies four times the longest edge, and a tenth of the relaxation time of "
      "a bath of type rescaling or langevin, which acts at the ends of epochs";
  Parameter lengthen{.name = "lengthen",
                     .type = Parameter::Type::boolean,
                     .fallback = "none",
                     .unit = "-",
                     .meaning =
                         "whether an epoch may be 4, 16, 64, … steps long if the spheres had too few collisions in the "
                         "one before, as where few spheres have most of the energy; default: true if no step is given"};
  Parameter limit = parameter::max_events_per_step();
  limit.meaning = "largest number of collisions per particle in an epoch; more end the run with an error";
  return {.name = "free-flight",
          .title = "Event-driven hard spheres",
          .order = "exact",
          .conserves = "energy and linear momentum, to rounding",
          .parameters = {epoch, lengthen, limit},
          .documentation =
              "Exact flight between collisions, for hard spheres without forces or in a uniform field. There is "
              "no time step: the trajectory is exact to rounding. `step` is only the length of an epoch.",
          .source =
              "Alder, Wainwright, J. Chem. Phys. 31 (1959) 459; Rapaport, J. Comput. Phys. 34 (1980) 184; "
              "Lubachevsky, J. Comput. Phys. 94 (1991) 255",
          .stepping = false,
          .smooth_forces = false,
          .exact = true,
          .steps = true,
          .shear = true,
          .in_2d = make<FreeFlight, 2>,
          .in_3d = make<FreeFlight, 3>};
}

}  // namespace carom::integrator
