// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A run: advances a system slab by slab, measures energies and calls observers at their due times.
//
//   Simulation<2> run(std::move(system), "edda", {{"step", 0.01}}, {.end_time = 6});
//   run.add(writer);
//   run.run();
//
// Observing changes nothing: observers get copies, and due times do not shorten slabs.

#include <algorithm>
#include <array>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/integrators/integrator.h"
#include "engine/ranks/system.h"
#include "engine/run/blocking.h"
#include "engine/run/run_clock.h"

namespace carom {

/// When a run ends and what observers get on the way. At least one end is given; the run stops at the first it reaches.
struct Plan {
  double step = 0;  ///< length of a step [time], > 0
  /// The longest step that the method chooses, 0: any. Of fixed steps: up to which they lengthen as a gas with
  /// inelastic contacts cools, 0: never [time].
  double longest_step = 0;
  /// The method chooses its steps, `step` is the first one: the local error of a step (engine/stepping/local_error.h)
  /// that is wanted; 0: steps are fixed.
  double accuracy = 0;
  double shortest_step = 0;             ///< of those that the method chooses [time]
  std::optional<std::int64_t> steps{};  ///< number of steps
  std::optional<double> end_time{};     ///< the last step is shortened to end there
  std::optional<std::uint64_t>
      collisions{};  ///< pair collisions; free flight stops exactly there, other methods at the end of the step
  double frame_interval = 0;   ///< simulated time between frames; 0: first and last only
  double thermo_interval = 0;  ///< simulated time between thermo rows; 0: first and last only
  bool events = false;         ///< pass every contact to the observers
  /// Statistics::series and the samples of observers begin when the initial transient of the rows has ended, at the end
  /// of a step or epoch (engine/run/transient.h); needs a thermo_interval.
  bool from_equilibrium = false;

  double slack() const { return 1e-9 * step; }  ///< tolerance of due times [time]
  /// Tolerance of the end time, more than the rounding of a time near it [time].
  double end_slack() const {
    return std::max(slack(), 4 * std::numeric_limits<double>::epsilon() * end_time.value_or(0));
  }
};

/// Why a run, or a ramp of its bath, would never end. `what` is empty if it ends.
struct EndlessRun {
  enum class Cause { run, collisions, bath } cause = Cause::run;
  std::string what, remedy;
};

/// Why methods with steps refuse steps of finite height next to a law of contacts.
inline constexpr std::string_view steps_and_laws =
    "where contacts lose energy, pairs come to rest at the ranges of wells and shoulders, and methods with steps of "
    "time cannot hold them there; leave out [[contact]] or each 'range', or take free-flight";

/// Checks the ends of a plan. `info`: the method, null if it is unknown; `ramp`: the bath has a ramp without times.
EndlessRun endless(const Plan& plan, const IntegratorInfo* info, bool ramp);

/// The first and last time of a run that starts at this step and time: those of a ramp of the bath's temperature for
/// which none are given. Throws Error(Failure::deck) if the plan has no last time.
std::array<double, 2> ramp_times(const Plan& plan, std::int64_t start_step, double start_time);

/// The load on a wall between two thermo rows.
struct WallLoad {
  Id number = 0;
  double force = 0;  ///< mean force on the spheres, along the normal [force]
  double area = 0;   ///< Box::area() [length^(D−1)]
  /// The pressure on a wall with an area [energy/length^D], the force on others.
  double load() const { return area > 0 ? force / area : force; }
};

/// The numbers of a Snapshot that are state of a run: checkpoints store the bytes of this struct, which has no padding.
template <int D>
struct Readings {
  double time = 0;
  std::int64_t step = 0;              ///< steps completed (in free flight a last epoch that has begun counts, too)
  std::uint64_t collisions = 0;       ///< pair collisions so far
  double kinetic = 0, potential = 0;  ///< [energy]; K with that of spins, V with its long-range corrections
  double shadow = std::numeric_limits<double>::quiet_NaN();  ///< S_h [energy]; NaN if the method has none
  std::array<double, D> momentum{};  ///< an array, because a Vec is aligned and would leave gaps in the struct
  double temperature = 0;  ///< Σ m v²/(D N) of the N particles that are not fixed, in units of energy (k_B = 1); total
                           ///< momentum is not subtracted
  double dissipated = 0, work = 0, heat = 0;  ///< sums of ContactTally so far, `work` with that of shear [energy]
  double step_length = 0;                     ///< of the last step or epoch [time]
};

/// The numbers of a Snapshot that runs with rough contacts store in addition.
struct SpinReadings {
  double rotational = 0;              ///< the part of K that is in spins, ½ Σ I ω² [energy]
  double rotational_temperature = 0;  ///< Σ I ω²/(f N), f = 1 in two dimensions, 3 in three [energy]
};

/// The numbers of a Snapshot that runs with steps store in addition.
struct StepReadings {
  double step_energy = 0;  ///< the part of V that is in steps [energy]
  double bonds = 0;        ///< pairs inside the outermost of their steps, for each particle
};

/// The numbers of a Snapshot that runs in a sheared box have in addition.
struct ShearReadings {
  /// −P_xy since the last thermo row, from the work of the flow; NaN in a sheared box while the flow rests or turns, 0
  /// in others [energy/length^D].
  double shear_stress = 0;
};

/// What an observer gets: a state and its observables, all at `time`.
template <int D>
struct Snapshot : Readings<D>, SpinReadings, StepReadings, ShearReadings {
  const Particles<D>* particles = nullptr;  ///< all particles; with several ranks this rank's block (with ids)
  double max_energy_error = 0;              ///< as in Statistics, so far [energy]
  double pressure = 0;  ///< virial: (Σ m v² + Σ d·F + Σ d·impulse/Δt)/(D V), collisions since the last thermo row
  std::vector<WallLoad> walls{};  ///< in thermo rows: of all walls, in the order of Box::walls()
  double total() const { return this->kinetic + this->potential; }
  /// What stays constant, whatever contacts, walls, baths and shear do.
  double conserved() const { return total() + this->dissipated - this->work - this->heat; }
};

/// The times at which an observer needs the particles: start, start + interval, …
struct Sampling {
  double interval = 0;  ///< simulated time; 0: never
  double start = 0;     ///< ≥ 0
};

template <int D>
class Observer {
 public:
  virtual ~Observer() = default;
  /// Called once before the run begins.
  virtual Sampling sampling() const { return {}; }
  /// Gets copies of all particles at a time of sampling(): exactly then in free flight, otherwise at the first step end
  /// at or after this time. No energies are measured, so frequent samples are cheap. With several ranks only rank 0 has
  /// the particles, or, if divided(), every rank has its own, and perhaps copies of others (Particles::owns).
  virtual void sample(double /*time*/, const Particles<D>&) {}
  virtual bool divided() const { return false; }
  /// Registers what the observer accumulates as state of the run; the names begin with `name`.
  virtual void add_state(Fields& /*fields*/, const std::string& /*name*/) {}
  virtual void frame(const Snapshot<D>&) {}
  virtual void thermo(const Snapshot<D>&) {}
  /// Gets the executed contacts of one slab in key order (an epoch may have several slabs); key.time is relative to
  /// `slab_start`. With several ranks, called on rank 0 only.
  virtual void contacts(double /*slab_start*/, std::span<const Contact<D>>) {}
  /// Whether it needs contacts() even without Plan::events; the same on all ranks. Those of a slab up to the time of a
  /// sample come before the sample.
  virtual bool needs_contacts() const { return false; }
  /// Called after every slab with the progress of the run; must be cheap.
  virtual void progress(const struct Statistics&) {}
};

/// Statistics of a run: current while it runs, final once run() has returned.
struct Statistics {
  std::int64_t steps = 0;
  double step_length = 0;  ///< of the last step [time]
  /// The extremes of the steps of this run, without the last one if the end made it shorter; 0: there was none [time].
  double shortest_step = 0, longest_step = 0;
  double end_time = 0;       ///< simulated time reached
  double fraction_done = 0;  ///< part of the plan that is done, 0…1
  /// Where a branch started. Its sums, means and extremes are of the steps after this state.
  std::int64_t start_steps = 0;
  double start_time = 0;
  Counters counters;
  double force_passes = 0;  ///< pair evaluations / interacting pairs

  double energy_initial = 0, energy_after_first_step = 0, energy_final = 0;
  std::optional<double> rotational_energy;  ///< the part of energy_final that is in spins, if contacts are rough
  double first_step_error = 0;              ///< |H + drained| after the first step less that before it
  double energy_reference = 0;              ///< max(|H₁|, K₁ + Σ|V|), the divisor for energy errors
  double energy_scale = 0;                  ///< max(|H₀|, K₀ + Σ|V|) at the start; energy_reference if this is 0
  /// The long-range corrections (engine/forces/potentials/tail.h), which the energies above and the pressures include.
  /// They are constants; energy_reference and the errors of H exclude them.
  double tail_energy = 0, tail_pressure = 0;
  /// The largest local error of a slab, estimated by edda and cdda, of fixed steps now and then; its particle and the
  /// time at the end of the slab.
  double local_error = 0, local_error_time = 0;
  std::uint64_t local_error_id = 0;
  double max_energy_error = 0;  ///< max over all steps of |E − E₁|, E = H + dissipated − work − heat, E₁ after the
                                ///< first step (free flight: at the start)
  std::optional<double>
      max_shadow_energy_error;  ///< Verlet types; with more than 100 particles only at thermo rows and frames
  std::optional<double> max_momentum_error;  ///< if momentum is conserved (no walls, no fields): max |P − P₀|
  /// The deepest overlap that is more than rounding, if there was one; its time is that of the run.
  std::optional<Overlap> overlap;
  double mean_pressure = 0;   ///< over the whole run
  double collision_rate = 0;  ///< 2 × pair collisions per unit time and particle: the rate for one sphere
  /// The mean time and the mean length of a sphere's flights between two pair collisions: N t/(2 collisions), and this
  /// time × the mean speed. The mean of |v| over all particles is computed at slab ends and averaged over time by the
  /// trapezoidal rule. Absent if there was no collision, and if particles are fixed.
  std::optional<double> mean_free_time, mean_free_path;
  /// With Plan::from_equilibrium, once known: when the transient ended, and the time from which means are taken.
  struct Equilibrium {
    double transient_end = 0, start = 0;
  };
  std::optional<Equilibrium> equilibrium;
  /// Means over time with their errors, of samples of one step or epoch each: the columns of `series` are these, then
  /// the force on each wall by its number (on both sides of a wall by the lower one), then in a sheared box the stress.
  static constexpr std::array mean_names = {"pressure",       "temperature",    "potential",
                                            "collision_rate", "mean_free_time", "mean_free_path"};
  Blocking series;
  double shear_rate = 0;                             ///< of the box, if it is constant [1/time]
  std::vector<std::array<double, 2>> shear_rates{};  ///< Box::shear_rates
  double wall_seconds = 0;                           ///< spent in the loop of run()
  bool stopped_early = false;                        ///< should_stop has ended it

  /// The estimate of a column of `series`; nothing but NaN if there is no such column.
  Estimate estimate(std::size_t column) const {
    return column < series.columns() ? series.estimate(column) : Estimate();
  }
  /// The mean of −P_xy in a sheared box; nothing but NaN in others.
  Estimate shear_stress() const { return shear_rate != 0 ? estimate(series.columns() - 1) : Estimate(); }
  /// Where an estimate has no standard error: the time to which the run must go at least to give it one, at the
  /// correlations seen so far. NaN if there is one, or nothing can be said.
  double needed_time(const Estimate& estimate) const {
    const auto samples = static_cast<double>(series.samples());
    const double start = equilibrium ? equilibrium->start : start_time;
    if (!(estimate.needed > samples) || samples == 0) return std::numeric_limits<double>::quiet_NaN();
    return start + (end_time - start) * estimate.needed / samples;
  }

  void archive(Archive& archive) {
    archive(steps, step_length, shortest_step, longest_step, end_time, fraction_done, start_steps, start_time,
            local_error, local_error_time, local_error_id, counters, force_passes, energy_initial,
            energy_after_first_step, energy_final, first_step_error, energy_reference, energy_scale, tail_energy,
            tail_pressure, max_energy_error, max_shadow_energy_error, max_momentum_error, overlap, mean_pressure,
            collision_rate, mean_free_time, mean_free_path, equilibrium, series, wall_seconds, stopped_early);
  }
};

template <int D>
class Monitor;

template <int D>
class Simulation {
 public:
  /// `info` must be the declaration of the integrator.
  Simulation(std::unique_ptr<System<D>>&& system, const IntegratorInfo& info, std::unique_ptr<Integrator<D>> integrator,
             Plan plan);
  /// Makes an integrator by its name in the deck, with defaults for parameters that are not given. The step is given
  /// either there or in the plan; free flight chooses its own. Throws Error(Failure::deck) for wrong parameters or
  /// plans and for forces that the integrator does not handle, and Error(Failure::initial_state) for a wrong system
  /// (System::check(), spheres that overlap or are not inside the walls); the caller keeps the system if it throws.
  Simulation(std::unique_ptr<System<D>>&& system, std::string_view integrator, Parameters given, Plan plan)
      : Simulation(std::move(system), find_integrator(integrator), std::move(given), plan) {}
  /// Makes an integrator by its declaration, which must outlive the run.
  Simulation(std::unique_ptr<System<D>>&& system, const IntegratorInfo& info, Parameters given, Plan plan)
      : Simulation(std::move(system), info, prepare(*system, info, std::move(given), plan)) {}
  ~Simulation();

  /// The observer must outlive the run. Throws Error(deck) if its sampling interval is too short to count.
  void add(Observer<D>& observer);

  /// Functions of the caller that are called during a run; all are collective.
  struct Hooks {
    /// Called before each slab and at the end: true stops the run. system().fields then holds the state from which the
    /// run can be continued.
    std::function<bool()> should_stop{};
    /// Called now and then during a long step: true abandons the step, restores the state at its start, and
    /// should_stop() is called. Each rank calls `leave_here` on its own.
    std::function<bool()> leave{}, leave_here{};
    /// Called when all ranks have abandoned a step; should_stop() is called next.
    std::function<void()> left{};
    /// Continues a run: sets the state of the system, which is in blocks of ids (engine/run/state.h). The system
    /// already has the particles of this state.
    std::function<void()> restore{};
    /// Starts a branch: a new run from the particles of another run at this step and time. restore() then sets the
    /// integrator's state from earlier steps; it is empty if this state does not fit.
    struct Branch {
      StepCount start{};
      StepCount from{};  ///< the old run's step count if it gives exactly start.time, else `start`
    };
    std::optional<Branch> branch{};
  };
  /// Runs to the end of the plan, or until the run is stopped. May be called again, after extend() to continue, or with
  /// Hooks::restore to continue from another state of this run. Throws Error.
  void run(const Hooks& hooks);
  void run(const std::function<bool()>& should_stop = {}) { run(Hooks{.should_stop = should_stop}); }

  /// Ends a slab of free flight after this many collisions, so that checkpoints and stops do not have to wait for the
  /// end of the epoch; or after twice as many contacts, with walls and with the bath. The default is 500 000, which
  /// take less than a second, or 4N if this is more: starting a slab costs a fifth of a collision per particle, a
  /// twentieth of 4N collisions.
  void limit_slabs(std::uint64_t collisions) { clock_.limit_slabs(collisions); }
  /// Sets another end for the next run(); step and intervals stay as in the first plan.
  void extend(const Plan& end);

  /// Call in should_stop(): whether a run with a later end would continue from here with the same steps. This may be
  /// false after the next slab, which may meet the end.
  bool is_last_on_the_way() const { return clock_.is_last_on_the_way(statistics_); }

  const Statistics& statistics() const { return statistics_; }
  const System<D>& system() const { return *system_; }
  /// The system that hooks save and restore.
  System<D>& system() { return *system_; }

 private:
  struct Prepared {
    std::unique_ptr<Integrator<D>> integrator;
    Plan plan;
  };
  static Prepared prepare(const System<D>& system, const IntegratorInfo& info, Parameters given, Plan plan);
  Simulation(std::unique_ptr<System<D>>&& system, const IntegratorInfo& info, Prepared p)
      : Simulation(std::move(system), info, std::move(p.integrator), p.plan) {}

  void begin(const Hooks& hooks);
  Slab next_slab() const;
  bool fly(Slab& slab, SlabReport<D>& report, SlabWatch& watch);
  void act_of_bath(const Slab& slab, double complete, SlabReport<D>& report);
  void adapt(const Slab& slab, const SlabReport<D>& report, std::uint64_t contacts, double complete);
  void set_ramp();
  void lengthen_slabs(double length);
  void need_collisions() const;

  Plan plan_;  // checked before the system is moved
  std::unique_ptr<System<D>> system_;
  const IntegratorInfo& info_;
  std::unique_ptr<Integrator<D>> integrator_;
  std::vector<Observer<D>*> observers_;
  bool contacts_needed_ = plan_.events;
  Statistics statistics_;
  RunClock clock_{plan_, info_.stepping, system_->size()};
  double quiet_since_ = 0;               // end of the last slab with pair collisions
  std::unique_ptr<Monitor<D>> monitor_;  // from the first run() on
  std::size_t first_of_integrator_ = 0;  // its first entry in Fields::of_run()
};

}  // namespace carom
