// SPDX-License-Identifier: BSD-3-Clause
#include "engine/run/simulation.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/error.h"
#include "engine/forces/forces.h"
#include "engine/laws/wall_options.h"
#include "engine/run/baths.h"
#include "engine/run/monitor.h"
#include "engine/run/step_choice.h"
#include "engine/setup/epoch.h"
#include "engine/setup/initial_state.h"

namespace carom {

namespace {
/// Output intervals shorter than this fraction of a step are refused: counting them would take too long.
constexpr double kLeastInterval = 1e-6;
/// More kicks of a particle in a step change nothing: that its velocity then stems from a kick has the probability
/// 1 − e⁻¹⁰⁰.
constexpr double kMostKicks = 100;
/// Beyond this number of cells of the length 1/rate, which bath.cc counts, the doubles are farther apart than a cell.
constexpr double kMostCells = 0x1p52;
/// After so many oscillations of a shaken wall its phase is known to 10⁻⁶.
constexpr double kMostOscillations = 1e9;
/// Flight distance without any pair collision after which a run in an open box ends [longest edge].
constexpr double kFarApart = 1e4;
template <int D>
double largest_radius(const System<D>& system) {
  const auto radii = system.decomposition.radii();
  return radii.empty() ? 0 : *std::ranges::max_element(radii);
}

template <int D>
void check_spheres(const System<D>& system) {
  const double diameter = 2 * largest_radius(system);
  for (int k = 0; k < D; ++k)
    if (system.box.periodic(k) && system.box.edges[k] < diameter)
      throw Error(Failure::initial_state, "the periodic box is " + short_text(system.box.edges[k]) + " long on axis " +
                                              std::to_string(k) + ", less than a diameter of " + short_text(diameter) +
                                              "; enlarge it, a sphere must not touch itself");
  if (const std::string problem = step_problem(system); !problem.empty()) throw Error(Failure::initial_state, problem);
  if (const Outsiders out = find_outsiders(system); out.spheres > 0)
    throw Error(Failure::initial_state, "particle " + std::to_string(out.worst) + " reaches " + short_text(out.depth) +
                                            " beyond " + system.box.wall_name(out.wall) +
                                            "; keep it a radius from every wall, or enlarge the box");
  if (const Overlaps overlaps = find_overlaps(system); overlaps.pairs > 0)
    throw Error(Failure::initial_state, "particles " + std::to_string(overlaps.lo) + " and " +
                                            std::to_string(overlaps.hi) + " overlap, at distance " +
                                            short_text(overlaps.distance) + "; move them apart");
}

void check_interval(double interval, double step) {
  if (interval > 0 && interval < kLeastInterval * step)
    throw Error(Failure::deck,
                "an output interval is shorter than a millionth of the step; give 0, the step or something longer");
}

/// √(Σ m v²/(D Σ m)) [length/time].
template <int D>
double thermal_speed(const System<D>& system) {
  const auto& p = system.particles;
  const double twice_kinetic =
      sum_over_all<D>(system, [&](Id i) { return moving_mass(p.mass[i]) * p.v[i].squaredNorm(); });
  const double mass = sum_over_all<D>(system, [&](Id i) { return moving_mass(p.mass[i]); });
  return std::sqrt(twice_kinetic / (D * mass));
}

/// A rest speed above the thermal speed would make most contacts elastic. Forces may move spheres that are slow at the
/// start, such as a pile at rest.
template <int D>
void check_rest_speeds(const System<D>& system) {
  if (system.box.contacts.elastic() || !system.interactions.empty()) return;
  const double thermal = thermal_speed(system);
  for (const ContactLaw& law : system.box.contacts.all())
    if (thermal > 0 && law.rest_speed >= thermal)
      throw Error(Failure::deck, "the rest_speed " + short_text(law.rest_speed) +
                                     " of a contact is above the thermal " + "speed at the start, " +
                                     short_text(thermal) + "; give a smaller one, or none");
}

/// Throws if the method refuses steps or a force, or the bath does not fit the species; fixed particles matter from
/// count_moving() on.
template <int D>
void check_laws(const System<D>& system, const IntegratorInfo& info) {
  if (const std::string no = info.refusal_of_shear(system, system.has_fixed()); !no.empty())
    throw Error(Failure::deck, no);
  if (const std::string no = info.refusal_of_steps(); !no.empty() && !system.box.steps.empty())
    throw Error(Failure::deck, no);
  if (info.stepping && std::isfinite(system.box.steps.least_climb()) && !system.box.contacts.elastic())
    throw Error(Failure::deck, std::string(steps_and_laws));
  if (const Bath& bath = system.box.bath;
      bath.damps() && bath.friction.size() != 1 && bath.friction.size() != system.species.size())
    throw Error(Failure::deck, "the bath has " + std::to_string(bath.friction.size()) + " frictions for " +
                                   std::to_string(system.species.size()) +
                                   " species; give one for all, or one for each");
  for (const auto& term : system.interactions)
    if (const std::string no = info.refusal(*term, system.has_fixed()); !no.empty()) throw Error(Failure::deck, no);
}

/// Throws if the bath kicks, or a wall oscillates, too often for the slab.
template <int D>
void check_rates(const Box<D>& box, const Slab& slab, bool stepping) {
  const double end = slab.start + slab.length, kicks = box.bath.rate * slab.length;
  if (box.bath.kicks() && ((stepping && kicks > kMostKicks) || box.bath.rate * end > kMostCells))
    throw Error(Failure::numerical, "the bath would kick each particle " + short_text(kicks) + " times in " +
                                        short_text(slab.length) + " units of time" +
                                        (stepping ? ", and only the last kick matters; take a rate of at most " +
                                                        short_text(kMostKicks / slab.length)
                                                  : "; take a smaller rate"));
  for (const WallOptions<D>& each : box.options)
    if (const double oscillations = each.frequency * std::min(end, each.until); oscillations > kMostOscillations)
      throw Error(Failure::numerical,
                  box.wall_name(each.number) + " would oscillate " + short_text(oscillations) + " times until time " +
                      short_text(end) + ", so often that its phase is lost to rounding; take a frequency of at most " +
                      short_text(kMostOscillations / end) + ", or end the run earlier");
}

void refuse_endless(const Plan& plan, const IntegratorInfo* info, bool ramp) {
  if (const EndlessRun why = endless(plan, info, ramp); !why.what.empty())
    throw Error(Failure::deck, why.what + "; " + why.remedy);
}

Plan checked(const Plan& plan, const IntegratorInfo& info, const Bath& bath) {
  if (!(plan.step > 0)) throw Error(Failure::deck, "the step must be positive");
  if (plan.accuracy > 0 && !info.adapts)
    throw Error(Failure::deck,
                "'" + std::string(info.name) +
                    "' has fixed steps, because the energy is exact at any step with edda and cdda only; "
                    "leave accuracy out, or take one of these");
  if (plan.shortest_step > plan.step)
    throw Error(Failure::deck, "shortest_step is longer than the step; give a shorter one, or none");
  if (plan.longest_step != 0 && !(plan.longest_step >= plan.step))
    throw Error(Failure::deck, "longest_step is shorter than the step; give a longer one, or none");
  refuse_endless(plan, &info, bath.needs_ramp_time());
  for (const double interval : {plan.frame_interval, plan.thermo_interval}) check_interval(interval, plan.step);
  return plan;
}
}  // namespace

EndlessRun endless(const Plan& plan, const IntegratorInfo* info, bool ramp) {
  using enum EndlessRun::Cause;
  if (plan.steps || plan.end_time) return {};
  if (!plan.collisions) return {run, "the run has no end", "give steps, end_time or collisions"};
  if (info != nullptr && !info->hard_cores)
    return {collisions, "'" + std::string(info->name) + "' has no collisions, the run would never end",
            "give steps or end_time"};
  if (ramp)
    return {bath, "the temperature of the bath is a ramp over a run without a last time",
            "give run.steps or run.end_time, or the ramp_time of the bath, or one temperature"};
  return {};
}

std::array<double, 2> ramp_times(const Plan& plan, std::int64_t start_step, double start_time) {
  refuse_endless(plan, nullptr, true);
  double end = plan.end_time.value_or(std::numeric_limits<double>::infinity());
  if (plan.accuracy > 0 && !plan.end_time)
    throw Error(Failure::deck,
                "the temperature of the bath is a ramp over a run of steps whose lengths are not known; give "
                "run.end_time, or the ramp_time of the bath");
  if (plan.steps && plan.accuracy == 0)
    end = std::min(end, start_time + static_cast<double>(*plan.steps - start_step) * plan.step);
  return {start_time, end};
}

template <int D>
Simulation<D>::Simulation(std::unique_ptr<System<D>>&& system, const IntegratorInfo& info,
                          std::unique_ptr<Integrator<D>> integrator, Plan plan)
    : plan_(checked(plan, info, system->box.bath)),
      system_(std::move(system)),
      info_(info),
      integrator_(std::move(integrator)) {}

template <int D>
typename Simulation<D>::Prepared Simulation<D>::prepare(const System<D>& system, const IntegratorInfo& info,
                                                        Parameters given, Plan plan) {
  system.check();
  check_laws(system, info);
  if (info.hard_cores) check_spheres(system);
  if (plan.step != 0 && given.has("step"))
    throw Error(Failure::deck, "the step is given twice; give it with the plan or with the integrator, not with both");
  for (const auto& [name, value] : {std::pair{"step", plan.step},
                                    {"longest_step", plan.longest_step},
                                    {"accuracy", plan.accuracy},
                                    {"shortest_step", plan.shortest_step}})
    if (value != 0 && !given.has(name)) given.set(name, value);
  choose_step(system, info, plan, given);
  given = completed(info.name, info.parameters, std::move(given));
  set_steps(plan, given);
  return {info.make<D>(given), plan};
}

template <int D>
Simulation<D>::~Simulation() = default;

template <int D>
void Simulation<D>::add(Observer<D>& observer) {
  check_interval(observer.sampling().interval, plan_.step);
  observers_.push_back(&observer);
  contacts_needed_ |= observer.needs_contacts();
}

template <int D>
void Simulation<D>::extend(const Plan& end) {
  plan_.steps = end.steps;
  plan_.end_time = end.end_time;
  plan_.collisions = end.collisions;
}

/// Registers the state of the run, and sets or measures it: at the start, to continue, or for a branch.
template <int D>
void Simulation<D>::begin(const Hooks& hooks) {
  Statistics& s = statistics_;
  Decomposition<D>& decomposition = system_->decomposition;
  const auto divide = [&] {
    return decomposition.divide(info_.local && !system_->box.sheared(), plan_.step, info_.hard_cores);
  };
  const auto make_monitor = [&] {
    monitor_ = std::make_unique<Monitor<D>>(*system_, info_, plan_, observers_, s);
    system_->fields.add_value("quiet since", quiet_since_);
    system_->fields.add_value("step count", clock_.count);
    system_->fields.add_value("pace", clock_.pace);
  };
  const bool again = monitor_ != nullptr;
  if (!again) {
    system_->need_spins();
    system_->count_moving();
    if (system_->moving() == 0 && system_->has_fixed())
      throw Error(Failure::deck, "all particles are fixed and nothing would move; give some a finite mass");
    check_laws(*system_, info_);
    if (!hooks.restore) check_rest_speeds(*system_);
    if (const std::string no = shear_problem(*system_, plan_.end_time); !no.empty()) throw Error(Failure::deck, no);
    const double contacts = info_.adapts ? contact_rate(*system_) : 0;
    if (info_.smooth_forces) {
      system_->quanta = quanta(*system_);
      s.counters.divisions += divide();
    }
    // A branch restores the state that is registered before, the integrator's, and measures again.
    if (!hooks.branch) make_monitor();
    first_of_integrator_ = system_->fields.of_run().size();
    integrator_->start(*system_, s.counters);
    if (info_.adapts)
      clock_.expect(info_.most_contacts, contacts,
                    clock_.adapts() ? first_step(*system_, plan_) : std::numeric_limits<double>::infinity());
  }
  if (again || hooks.restore) {
    decomposition.to_blocks();
    if (again) monitor_->forget();
    if (hooks.restore) hooks.restore();
    if (decomposition.ranks().rank() > 0) s.counters.seconds = {}, s.counters.events = {}, s.counters.windows = {};
    if (info_.smooth_forces) divide();
    s.stopped_early = false;
  }
  if (again) {
    clock_.go_on(s);
    return;
  }
  if (hooks.branch) {
    clock_.count = hooks.branch->from;
    s.start_steps = s.steps = hooks.branch->start.steps;
    s.start_time = s.end_time = quiet_since_ = hooks.branch->start.time;
    make_monitor();
    for (auto* observer : observers_) observer->progress(s);
  }
  if (hooks.branch || !hooks.restore) monitor_->start(*integrator_, !hooks.restore);
}

template <int D>
void Simulation<D>::run(const Hooks& hooks) {
  const auto clock_start = std::chrono::steady_clock::now();
  Statistics& s = statistics_;
  begin(hooks);
  set_ramp();
  if (info_.stepping && !clock_.adapts())
    if (const std::string no = shear_problem(*system_, plan_.end_time, plan_.step, clock_.count.time); !no.empty())
      throw Error(Failure::deck, no);
  SlabWatch watch(system_->fields, first_of_integrator_, hooks.leave, hooks.leave_here, info_.adapts);
  const double seconds_before = s.wall_seconds;
  const auto take_time = [&] {
    const auto elapsed = std::chrono::steady_clock::now() - clock_start;
    s.wall_seconds = seconds_before + std::chrono::duration<double>(elapsed).count();
  };
  std::vector<Contact<D>> contacts;
  const auto show_contacts = [&](const Slab& slab) {
    if (!contacts_needed_) return;
    const Stopwatch stopwatch(s.counters.seconds.output);
    if (system_->box.bath.kicks())
      std::erase_if(contacts, [](const auto& each) { return each.key.kind == EventKind::kick; });
    for (auto& contact : contacts) contact.key.time += clock_.count.within;
    for (auto* observer : observers_) observer->contacts(clock_.time_after(slab.index), contacts);
    contacts.clear();
  };
  for (;;) {
    const bool done = clock_.finished(s);
    take_time();
    if (hooks.should_stop && hooks.should_stop() && !done) {
      s.stopped_early = true;
      break;
    }
    if (done) break;
    Slab slab = next_slab();
    s.counters.divisions += system_->decomposition.divide_if_due(slab.index, slab.length);
    const std::vector<double> due = info_.stepping ? std::vector<double>{} : monitor_->due_within(slab);
    contacts.clear();
    SlabReport<D> report{.counters = s.counters,
                         .contacts = contacts_needed_ ? &contacts : nullptr,
                         .observe = due,
                         .observer =
                             [&](double offset, const Particles<D>& copies) {
                               show_contacts(slab);  // rows and events are written together
                               monitor_->observe(slab.start + offset, copies);
                             },
                         .watch = &watch};
    const auto met = [&] { return s.counters.sphere_sphere + s.counters.steps.events(); };
    const std::uint64_t cores = s.counters.sphere_sphere, collisions = met(), at_walls = s.counters.sphere_wall;
    if (!fly(slab, report, watch)) {
      if (hooks.left) hooks.left();
      continue;
    }
    show_contacts(slab);
    s.counters.seconds.communicate = system_->decomposition.seconds_waited();
    const std::uint64_t pairs = met() - collisions, walls = s.counters.sphere_wall - at_walls;
    if (s.counters.sphere_sphere > cores) quiet_since_ = slab.start + report.reached;
    const double complete = clock_.end_slab(slab, report.reached, pairs, walls, report.boxes, s);
    act_of_bath(slab, complete, report);
    if (info_.adapts) adapt(slab, report, 2 * pairs + walls, complete);
    if (complete > 0) s.step_length = complete;
    if (complete > 0 && !system_->box.bath.acts_at_ends() && !clock_.adapts()) lengthen_slabs(complete);
    if (!info_.stepping && plan_.collisions && !plan_.end_time && !plan_.steps) need_collisions();
    s.force_passes = s.counters.force_passes;
    s.fraction_done = clock_.fraction_done(s);
    take_time();
    monitor_->end_of_slab(report.reached, *integrator_, complete > 0 || !info_.stepping, clock_.finished(s));
    for (auto* observer : observers_) observer->progress(s);
  }
  // Rows and frames have the time of the step, as in a longer run.
  if (plan_.end_time && std::abs(s.end_time - *plan_.end_time) <= plan_.end_slack()) s.end_time = *plan_.end_time;
  monitor_->finish();
  system_->decomposition.to_blocks();
  take_time();
}

/// The next slab of the clock; where its length is free, it ends no later than the motion of a wall and the next change
/// of a flow, and before the strain of a sheared box is too large for its lists.
template <int D>
Slab Simulation<D>::next_slab() const {
  Slab slab = clock_.next_slab(statistics_);
  double left = system_->box.next_end(slab.start) - slab.start;
  if (system_->box.sheared()) left = std::min(left, longest_slab(*system_, slab.start));
  if ((!info_.stepping || clock_.adapts()) && left < slab.length) {
    slab.length = left;
    slab.ends_step = false;
  }
  return slab;
}

/// Advances the system by a slab, and repeats it with a wider halo, or made shorter, if needed; false: the slab was
/// abandoned, and the state is that of its start.
template <int D>
bool Simulation<D>::fly(Slab& slab, SlabReport<D>& report, SlabWatch& watch) {
  Decomposition<D>& decomposition = system_->decomposition;
  const double diameter = info_.hard_cores && !system_->box.plain() ? 2 * largest_radius(*system_) : 0;
  const auto no_room_text = [&](double after) {
    system_->box.begin_step(slab.start + after, 0);
    std::string what = diameter > 0 ? no_room(system_->box, diameter) : "";
    system_->box.begin_step(slab.start, info_.stepping ? slab.length : 0);
    return what;
  };
  const auto error = [&](const std::string& what) {
    return Error(Failure::numerical,
                 what + " (in step " + std::to_string(slab.index + 1) + ", from time " + short_text(slab.start) + ")");
  };
  // In free flight this is not checked here: the epoch may end after a number of collisions, before the walls meet.
  if (const std::string what = info_.stepping ? no_room_text(slab.length) : ""; !what.empty()) throw error(what);
  const double tilt = system_->box.tilt;
  for (Counters before = report.counters;;) try {  // until it returns or throws
      watch.begin();
      system_->box.tilt = tilt;
      system_->box.begin_step(slab.start, info_.stepping ? slab.length : 0);
      if (!system_->box.options.empty()) system_->box.check(Failure::numerical);
      check_rates(system_->box, slab, info_.stepping);
      if (ContactLaws& laws = system_->box.contacts; !laws.elastic()) {
        laws.thermal_speed = thermal_speed(*system_);
        laws.restitution_when_slow = info_.stepping ? 0 : 1;
      }
      integrator_->slab(*system_, slab, report);
      return true;
    } catch (HaloTooSmall) {
      decomposition.enlarge_halo(slab.index, slab.length);
      ++before.slabs_again;
      before.slabs_by_all += decomposition.knows_all() ? 1 : 0;
      report.counters = before;
      if (report.contacts) report.contacts->clear();
    } catch (const StepTooLong& wanted) {
      watch.restore();
      ++(clock_.adapts() ? before.steps_rejected : before.slabs_halved);
      report.counters = before;
      report.error = {};
      if (report.contacts) report.contacts->clear();
      clock_.shorten(slab, wanted);
      slab = next_slab();
    } catch (SlabLeft) {
      watch.restore();
      system_->box.tilt = tilt;
      report.counters = before;
      return false;
    } catch (const Error& e) {
      if (e.failure() != Failure::numerical) throw;
      // Squeezed spheres collide ever faster before there is no room.
      std::string what = no_room_text(2 * std::max(slab.length, clock_.adapts() ? 0 : plan_.step));
      for (const WallOptions<D>& each : system_->box.options)  // a shaken wall is farthest out a quarter and three
                                                               // quarters of a period after its phase is zero
        for (const double turns : {0.25, 0.75})
          if (const double left = turns - each.turns - each.frequency * slab.start; each.amplitude != 0 && what.empty())
            what = no_room_text((left - std::floor(left)) / each.frequency);
      throw error(what.empty() ? e.what() : what);
    }
}

/// What the bath does at the end of a slab: rescaling or damping at the end of a step or epoch of the length `complete`
/// (0: it goes on), all kicks of a slab of a stepping method.
template <int D>
void Simulation<D>::act_of_bath(const Slab& slab, double complete, SlabReport<D>& report) {
  const Bath& bath = system_->box.bath;
  const double start = clock_.adapts() ? slab.start : clock_.time_after(slab.index),
               length = clock_.adapts() ? slab.length : clock_.length_from(start);
  if (bath.rescales() && complete > 0) rescale(*system_, slab.index, start + length, length, report.counters);
  if (bath.damps() && complete > 0) damp(*system_, start + length, length, report.counters);
  if (bath.kicks() && info_.stepping) kick_all(*system_, slab.start, slab.length, report.counters);
}

/// Counts the slab of a method that adapts, and sets the length of the next one.
template <int D>
void Simulation<D>::adapt(const Slab& slab, const SlabReport<D>& report, std::uint64_t contacts, double complete) {
  Statistics& s = statistics_;
  if (const double error = report.error.of(slab.length); error > s.local_error) {
    s.local_error = error;
    s.local_error_id = report.error.id;
    s.local_error_time = s.end_time;
  }
  if (complete > 0 && !(clock_.adapts() && slab.length < clock_.pace.length)) {
    s.shortest_step = s.shortest_step > 0 ? std::min(s.shortest_step, complete) : complete;
    s.longest_step = std::max(s.longest_step, complete);
  }
  clock_.adapt(slab, report.error, contacts,
               clock_.adapts() ? longest_step(*system_, plan_, report.error.strongest)
                               : std::numeric_limits<double>::infinity());
}

/// Sets the times of a ramp of the bath's temperature, unless they are given or an earlier plan has set them.
template <int D>
void Simulation<D>::set_ramp() {
  Bath& bath = system_->box.bath;
  if (!bath.needs_ramp_time()) return;
  const auto [start, end] = ramp_times(plan_, statistics_.start_steps, statistics_.start_time);
  bath.ramp_start = start;
  bath.ramp_end = end;
}

/// For free flight that ends only after a number of collisions: throws if the spheres have separated for good.
template <int D>
void Simulation<D>::need_collisions() const {
  if (system_->box.closed()) return;
  double fastest = 0;
  for (const Vec<D>& v : system_->particles.v) fastest = std::max(fastest, v.norm());
  const double flown = (statistics_.end_time - quiet_since_) * system_->decomposition.largest(fastest);
  if (flown <= kFarApart * system_->box.edges.maxCoeff()) return;
  throw Error(Failure::numerical, "no two spheres have met for " + short_text(flown) +
                                      " of the fastest one's flight; they have left through an open boundary, and "
                                      "there will be no more collisions; give run.end_time, or close the box");
}

/// Sets the length of the next slab after one of this length: its number of collisions hardly changes as the gas cools,
/// and an epoch with too few collisions is followed by one that is longer by a power of four, so that ordinary gases
/// keep their steps. Collective.
template <int D>
void Simulation<D>::lengthen_slabs(double length) {
  const double most = clock_.most_steps();
  if (!(most > 1) || system_->box.sheared()) return;
  double steps = 1;
  if (!system_->box.contacts.elastic()) {
    const double speed = thermal_speed(*system_);
    if (clock_.count.first_speed == 0) clock_.count.first_speed = speed;
    if (speed > 0) steps = std::clamp(clock_.count.first_speed / speed, 1.0, most);
  }
  if (integrator_->lengthens()) {
    const double events = static_cast<double>(clock_.count.contacts) / static_cast<double>(system_->size());
    const double wanted = next_epoch(*system_, {length, events, clock_.count.boxes});
    while (4 * steps * plan_.step <= wanted) steps *= 4;
  }
  clock_.lengthen(steps);
}

template class Simulation<2>;
template class Simulation<3>;

}  // namespace carom
