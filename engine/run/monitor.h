// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Measures a run and calls its observers when they are due. The run itself never reads these measurements.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/forces/forces.h"
#include "engine/run/simulation.h"
#include "engine/run/transient.h"
#include "engine/search/neighbour_list.h"

namespace carom {

/// The next of the times interval, 2·interval, … or start, start + interval, …; infinity if there is no interval.
class Schedule {
 public:
  /// For output that is always written at the start.
  explicit Schedule(double interval) : interval_(interval) {}
  explicit Schedule(const Sampling& sampling) : interval_(sampling.interval), start_(sampling.start), next_(0) {}
  double due() const {
    return interval_ > 0 ? start_ + static_cast<double>(next_) * interval_ : std::numeric_limits<double>::infinity();
  }
  /// Advances to the first time after `time`.
  void pass(double time) {
    while (due() <= time) ++next_;
  }
  /// The same times, all later by `delay`.
  Schedule later(double delay) const {
    Schedule schedule = *this;
    schedule.start_ += delay;
    return schedule;
  }
  /// The index of the next time.
  std::int64_t& next() { return next_; }

 private:
  double interval_, start_ = 0;
  std::int64_t next_ = 1;
};

template <int D>
class Monitor {
 public:
  /// Keeps references to all arguments.
  Monitor(System<D>& system, const IntegratorInfo& info, const Plan& plan, const std::vector<Observer<D>*>& observers,
          Statistics& statistics);
  ~Monitor() {
    system_.fields.remove_working(this);
    system_.fields.settle = [] {};
  }
  Monitor(const Monitor&) = delete;
  Monitor& operator=(const Monitor&) = delete;

  /// Measures and shows the initial state of a run that is not continued; energies are those of the integrator's energy
  /// state. `fresh`: the last force pass was at that state.
  void start(const Integrator<D>& integrator, bool fresh);

  /// Due times inside a slab, for integrators that are exact at any time; relative to the slab's start, ascending.
  std::vector<double> due_within(const Slab& slab) const;

  /// Shows copies of the particles flown to a due time inside a slab.
  void observe(double time, const Particles<D>& copies);

  /// Measures the state at the end of a slab, updates the statistics, and shows the state if it is due, at the end of a
  /// `whole` step, or `last`.
  /// statistics.steps and end_time already include the slab, which advanced the time by `elapsed`.
  void end_of_slab(double elapsed, const Integrator<D>& integrator, bool whole, bool last);

  /// Forgets slabs that wait for their sums, because another state will be restored.
  void forget() { waiting_.clear(); }

  /// Shows the last state unless this was done before.
  void finish() {
    settle();
    shot_.particles = &system_.particles;
    show(shot_, true);
  }

 private:
  /// An observer with its own sampling times.
  struct Sampler {
    Observer<D>* observer;
    Schedule due;
  };

  /// What a measurement needs of each rank.
  struct Sums {
    MotionSums<D> motion;
    PotentialSums potential;
    OverlapTally overlaps;
    void add(const Sums& other) {
      motion.add(other.motion);
      potential.add(other.potential);
      overlaps.add(other.overlaps);
    }
  };
  /// A state whose sums over all ranks have not been made.
  struct Waiting {
    double time;
    std::int64_t step;
    const Particles<D>* particles;
    Sums own;
    ContactTally tally;
    double shadow_term = std::numeric_limits<double>::quiet_NaN(), elapsed = 0;
  };

  void sample(double time, const Particles<D>& state);
  Waiting observed(double time, const Particles<D>& state, const Integrator<D>* integrator, bool with_shadow,
                   bool fresh = true);
  Snapshot<D> measured(const Waiting& at, const Sums& sums);
  /// Whether samples wait for the end of the transient, and the time from which their times are counted.
  bool waits() const { return plan_.from_equilibrium && !statistics_.equilibrium; }
  double origin() const { return statistics_.equilibrium ? statistics_.equilibrium->start : 0; }
  void begin_means();
  Snapshot<D> measure(double time, const Particles<D>& state, const Integrator<D>* integrator, bool with_shadow,
                      bool fresh = true) {
    const Waiting now = observed(time, state, integrator, with_shadow, fresh);
    return measured(now, system_.decomposition.sum(now.own));
  }
  /// Whether the method has a shadow energy, which is known for boxes without shear.
  bool has_shadow() const { return info_.shadow && !system_.box.sheared(); }
  /// Whether the statistics have the mean of the shear stress: a flow that changes has none.
  bool has_mean_stress() const { return system_.box.sheared() && system_.box.shear_rates.empty(); }
  void settle();
  void take(const Waiting& slab, const Sums& sums);
  void show(Snapshot<D> shot, bool last);
  std::vector<WallLoad> wall_loads(double time);
  void count_from(const Snapshot<D>& shot);
  void add_to_series(const Waiting& slab, double path);
  void note_overlap(const Waiting& slab, const Sums& sums);
  void guard(double energy_before, double magnitude_before);
  std::string fastest(const Particles<D>& state) const;
  OverlapTally overlaps(double time);
  const Particles<D>& all_particles(const Particles<D>& state);

  System<D>& system_;
  const IntegratorInfo& info_;
  const Plan& plan_;
  const std::vector<Observer<D>*>& observers_;
  Statistics& statistics_;

  Schedule frames_, rows_;
  std::vector<Sampler> samplers_;
  /// A sum over contacts up to the last sample of Statistics::series.
  struct Sampled {
    ExactSum sum;
    double value = 0;
  };
  /// The measurements that a continued run needs.
  struct Account {
    double last_frame = -1, last_row = -1;           // when they were last shown; −1: never
    double last_row_virial = 0, last_row_shear = 0;  // collision virial and work of shear up to the last row
    double energy = 0;                               // H + dissipated − work − heat at the last measurement
    double magnitude = 0, virial = 0;                // K + Σ|V| and 2K + Σ d·F at the last measurement
    double virial_time = 0;                          // ∫ (2K + Σ d·F) dt
    double speed = 0, path = 0;                      // mean |v| at the last slab's end; ∫ mean |v| dt
    double first_energy = 0, first_shadow = 0;       // H₁ and S_h,1
    Sampled sampled_virial, sampled_shear;           // of collisions; the work of shear
    std::uint64_t sampled_collisions = 0;
    std::array<double, D> first_momentum{};
  } account_;
  double first_step_energy_ = 0;  // at the start of the run
  Transient transient_;
  std::optional<double> transient_end_;
  std::vector<Sampled> sampled_walls_;        // impulses of the walls, by number
  std::vector<Id> column_of_wall_;            // in Statistics::series, by number
  std::vector<double> last_row_impulses_;     // of the walls, by number, up to the last row
  std::vector<double> values_, weights_;      // of a sample of Statistics::series
  Snapshot<D> shot_;                          // at the last slab's end
  std::vector<Waiting> waiting_;              // the last slabs
  Tail tail_;                                 // added to output, not to H and its errors
  std::vector<Vec<D>> scratch_;               // for S_h
  std::optional<NeighbourList<D>> touching_;  // pairs that may overlap, or have a step between them
  Particles<D> gathered_;                     // collected from the blocks of all ranks
};

}  // namespace carom
