// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A run: slab after slab, with energies measured and observers called at their due times.
//
//   Simulation<2> run(std::move(system), "edda", {{"step", 0.01}}, {.end_time = 6});
//   run.add(writer);
//   run.run();
//
// Observing changes nothing: observers get copies, and no due time cuts a slab.

#include <algorithm>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/integrators/integrator.h"
#include "engine/ranks/system.h"

namespace carom {

/// When a run ends and what it shows on the way. Of several ends the first reached counts; at least one is given.
struct Plan {
  double step = 0;                      ///< length of a slab [time], > 0
  std::optional<std::int64_t> steps{};  ///< number of slabs
  std::optional<double> end_time{};     ///< the last slab is shortened to meet it
  std::optional<std::uint64_t>
      collisions{};            ///< pair collisions; free flight stops exactly there, the others at the slab's end
  double frame_interval = 0;   ///< simulated time between frames; 0: first and last only
  double thermo_interval = 0;  ///< simulated time between thermo rows; 0: first and last only
  bool events = false;         ///< pass every contact on to the observers

  double slack() const { return 1e-9 * step; }  ///< due times and ends are met up to this [time]
};

/// What an observer is shown: a state and its observables, all at `time`.
template <int D>
struct Snapshot {
  double time = 0;
  std::int64_t step = 0;                    ///< slabs completed (free flight: epochs begun or completed)
  std::uint64_t collisions = 0;             ///< pair collisions so far
  const Particles<D>* particles = nullptr;  ///< all of them; several ranks: this rank's block (with ids)
  double kinetic = 0, potential = 0;        ///< [energy]; V with its long-range corrections
  double shadow = std::numeric_limits<double>::quiet_NaN();  ///< S_h [energy]; NaN where the method has none
  double max_energy_error = 0;                               ///< largest |H − H₁| so far [energy]
  Vec<D> momentum = Vec<D>::Zero();
  double temperature = 0;  ///< 2K/(D N), in units of energy (k_B = 1); total momentum is not subtracted
  double pressure = 0;     ///< virial: (2K + Σ d·F + Σ d·impulse/Δt)/(D V), collisions since the last thermo row
  double total() const { return kinetic + potential; }
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
  /// Called once, before the run begins.
  virtual Sampling sampling() const { return {}; }
  /// Copies of all particles at a time of sampling(): exactly then with free flight, else at the first step end at or
  /// after it. Costs no measurement: this is the way to look often. Of several ranks rank 0 alone has the
  /// particles.
  virtual void sample(double /*time*/, const Particles<D>&) {}
  /// Registers what it accumulates as state of the run; `name` begins the names.
  virtual void add_state(Fields& /*fields*/, const std::string& /*name*/) {}
  virtual void frame(const Snapshot<D>&) {}
  virtual void thermo(const Snapshot<D>&) {}
  /// Executed contacts of one slab, in key order, of an epoch in pieces; key.time is relative to `slab_start`. Of
  /// several ranks on rank 0 only.
  virtual void contacts(double /*slab_start*/, std::span<const Contact<D>>) {}
  /// After every slab: how far the run has come. Cheap; called often.
  virtual void progress(const struct Statistics&) {}
};

/// The run's account of itself; final once run() has returned, current while it runs.
struct Statistics {
  std::int64_t steps = 0;
  double end_time = 0;       ///< simulated time reached
  double fraction_done = 0;  ///< of the plan, 0…1
  /// Of a branch: those of the state from which it started. Sums, means and extremes are of what came after it.
  std::int64_t start_steps = 0;
  double start_time = 0;
  Counters counters;
  double force_passes = 0;  ///< pair evaluations / interacting pairs

  double energy_initial = 0, energy_after_first_step = 0, energy_final = 0;
  double energy_reference = 0;  ///< max(|H₁|, K₁ + Σ|V|): what to divide energy errors by
  double energy_scale = 0;      ///< the same at the start, H₀; where that is 0, energy_reference
  /// The long-range corrections in the energies above and in pressures (engine/forces/potentials/tail.h). They are
  /// constants; energy_reference and the errors of H are without them.
  double tail_energy = 0, tail_pressure = 0;
  double max_energy_error = 0;  ///< max over all steps of |H − H₁|, H₁ after the first step (free flight: at the
                                ///< start); H less the work of walls that move
  std::optional<double>
      max_shadow_energy_error;  ///< Verlet types; of more than 100 particles at thermo rows and frames only
  std::optional<double> max_momentum_error;  ///< where nothing takes momentum (no walls, no fields): max |P − P₀|
  double mean_pressure = 0;                  ///< over the whole run
  double collision_rate = 0;  ///< pair collisions a unit time and particle, times two: what one sphere suffers
  /// Of the flight of one sphere from one pair collision to the next: its mean time N t/(2 collisions), and its mean
  /// length, that time × the mean speed. The mean of |v| over all particles is taken at slab ends and averaged over
  /// time by the trapezoidal rule. Absent while nothing has collided.
  std::optional<double> mean_free_time, mean_free_path;
  double wall_seconds = 0;     ///< of the run's loop
  bool stopped_early = false;  ///< by should_stop
};

/// Steps are counted from here on: step n ends at time + (n − steps) · the plan's step.
struct StepCount {
  std::int64_t steps = 0;
  double time = 0;
  /// How far an epoch of free flight has come that took more collisions than one slab may [time].
  double within = 0;
};

template <int D>
class Monitor;

template <int D>
class Simulation {
 public:
  /// The integrator and its info must belong together.
  Simulation(std::unique_ptr<System<D>>&& system, const IntegratorInfo& info, std::unique_ptr<Integrator<D>> integrator,
             Plan plan);
  /// An integrator by its name in the deck, with defaults for the parameters that are not given. The step is given
  /// once, there or in the plan; free flight chooses one by itself. Throws Error(Failure::deck) about parameters,
  /// forces that the integrator does not know and plans, and Error(Failure::initial_state) about the system
  /// (System::check(), spheres that overlap or are not inside the walls); the caller still has the system then.
  Simulation(std::unique_ptr<System<D>>&& system, std::string_view integrator, Parameters given, Plan plan)
      : Simulation(std::move(system), find_integrator(integrator), std::move(given), plan) {}
  /// The same by a declaration, which outlives the run.
  Simulation(std::unique_ptr<System<D>>&& system, const IntegratorInfo& info, Parameters given, Plan plan)
      : Simulation(std::move(system), info, prepare(*system, info, std::move(given), plan)) {}
  ~Simulation();

  /// Observers outlive the run. Throws Error(deck) where one wants samples at intervals that cannot be counted.
  void add(Observer<D>& observer);

  /// What a caller does while a run goes on; all of it is collective.
  struct Hooks {
    /// Before each slab and at the end: true stops the run. What system().fields holds then is the state of the run,
    /// from which it can be continued.
    std::function<bool()> should_stop{};
    /// Asked now and then within a step that takes long: true has it left, with the state it started from, and
    /// should_stop() asked. `leave_here` is asked by each rank for itself.
    std::function<bool()> leave{}, leave_here{};
    /// A step was left on all ranks; should_stop() comes next.
    std::function<void()> left{};
    /// Continues a run: sets the state of the system, which is in blocks of ids (engine/run/state.h).
    /// The system has the particles as they were at that state already.
    std::function<void()> restore{};
    /// Starts a branch, a new run from the particles of another at this step and time. restore() then sets what the
    /// integrator has kept of the steps before, and is empty where that does not fit.
    struct Branch {
      StepCount start{};
      StepCount from{};  ///< where the end of `start` is not exactly there by this count, `start` itself
    };
    std::optional<Branch> branch{};
  };
  /// Runs to the end of the plan, or until it is stopped. May be called again, after extend() to go on, or with
  /// Hooks::restore to go on from another state of this run. Throws Error.
  void run(const Hooks& hooks);
  void run(const std::function<bool()>& should_stop = {}) { run(Hooks{.should_stop = should_stop}); }

  /// After so many collisions an epoch of free flight goes on in another slab: what is asked meanwhile, a checkpoint or
  /// to stop, waits for the slab's end. To begin with 500 000, which take less than a second, or 4N where that is more:
  /// to start a slab costs a fifth of a collision for each particle, a twentieth of what 4N collisions cost.
  void limit_slabs(std::uint64_t collisions) { most_collisions_ = collisions; }
  /// Another end for the next run(); step and intervals stay those of the first plan.
  void extend(const Plan& end);

  /// In should_stop(): whether a run with a later end would go on from here as this one has come here, and perhaps no
  /// longer after the next slab, which may meet the end.
  bool is_last_on_the_way() const;

  const Statistics& statistics() const { return statistics_; }
  const System<D>& system() const { return *system_; }
  /// What hooks save and restore.
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
  bool fly(const Slab& slab, SlabReport<D>& report, SlabWatch& watch);
  double time_of(std::int64_t step) const {
    return count_.time + static_cast<double>(step - count_.steps) * plan_.step;
  }
  Slab next_slab() const;
  bool finished() const;
  void need_collisions() const;
  double fraction_done() const;

  Plan plan_;  // checked before the system is taken
  std::unique_ptr<System<D>> system_;
  const IntegratorInfo& info_;
  std::unique_ptr<Integrator<D>> integrator_;
  std::vector<Observer<D>*> observers_;
  Statistics statistics_;
  StepCount count_;
  double quiet_since_ = 0;  // the last slab with pair collisions
  std::uint64_t most_collisions_ = std::max<std::uint64_t>(500'000, 4 * system_->size());  // in a slab of an epoch
  std::optional<std::uint64_t> last_collisions_;  // of the last slab, where it was flown here
  std::unique_ptr<Monitor<D>> monitor_;           // from the first run() on
  std::size_t first_of_integrator_ = 0;           // its entries among Fields::of_run()
};

}  // namespace carom
