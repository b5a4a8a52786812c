// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// What is measured while a run goes on, and when observers are shown it. The run itself never looks at it.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/run/simulation.h"
#include "engine/search/neighbour_list.h"
#include "engine/setup/placement.h"

namespace carom {

/// The next of the times interval, 2·interval, …, or of start, start + interval, …; never, where there is no interval.
class Schedule {
 public:
  /// Of what is shown at the start in any case.
  explicit Schedule(double interval) : interval_(interval) {}
  explicit Schedule(const Sampling& sampling) : interval_(sampling.interval), start_(sampling.start), next_(0) {}
  double due() const {
    return interval_ > 0 ? start_ + static_cast<double>(next_) * interval_ : std::numeric_limits<double>::infinity();
  }
  /// Moves on to the first time after `time`.
  void pass(double time) {
    while (due() <= time) ++next_;
  }
  /// Which of the times is next.
  std::int64_t& next() { return next_; }

 private:
  double interval_, start_ = 0;
  std::int64_t next_ = 1;
};

template <int D>
class Monitor {
 public:
  /// Keeps references to all of these.
  Monitor(System<D>& system, const IntegratorInfo& info, const Plan& plan, const std::vector<Observer<D>*>& observers,
          Statistics& statistics);
  ~Monitor() { system_.fields.remove_working(this); }
  Monitor(const Monitor&) = delete;
  Monitor& operator=(const Monitor&) = delete;

  /// Measures and shows the state at the start, of a run that is not continued; energies at the integrator's energy
  /// state. `fresh`: its last force pass was there.
  void start(const Integrator<D>& integrator, bool fresh);

  /// Due times inside a slab, for integrators that are exact at any time: since the slab's start, ascending.
  std::vector<double> due_within(const Slab& slab) const;

  /// Shows copies of the particles flown to a due time inside a slab.
  void observe(double time, const Particles<D>& copies);

  /// Measures the state at the end of a slab, updates the statistics, shows it where it is due or `last`.
  /// statistics.steps and end_time already include the slab, which advanced the time by `elapsed`.
  void end_of_slab(double elapsed, const Integrator<D>& integrator, bool last);

  /// Shows the last state, unless it has been shown.
  void finish() {
    shot_.particles = &system_.particles;
    show(shot_, true);
  }

 private:
  /// An observer that looks at times of its own.
  struct Sampler {
    Observer<D>* observer;
    Schedule due;
  };

  void sample(double time, const Particles<D>& state);
  Snapshot<D> measure(double time, const Particles<D>& state, const Integrator<D>* integrator, bool with_shadow,
                      bool fresh = true);
  void show(Snapshot<D> shot, bool last);
  void count_from(const Snapshot<D>& shot);
  void guard(double energy_before, double magnitude_before);
  std::string fastest(const Particles<D>& state) const;
  Overlaps overlaps();
  const Particles<D>& all_particles(const Particles<D>& state);

  System<D>& system_;
  const IntegratorInfo& info_;
  const Plan& plan_;
  const std::vector<Observer<D>*>& observers_;
  Statistics& statistics_;

  Schedule frames_, rows_;
  std::vector<Sampler> samplers_;
  /// What goes on with a run that is continued.
  struct Account {
    double last_frame = -1, last_row = -1;      // when they were last shown; −1: not yet
    double last_row_virial = 0;                 // collision virial up to the last row
    double energy = 0;                          // H of the last measurement
    double magnitude = 0, virial = 0;           // of the last measurement: K + Σ|V|, 2K + Σ d·F
    double virial_time = 0;                     // ∫ (2K + Σ d·F) dt
    double speed = 0, path = 0;                 // mean |v| at the last slab's end; ∫ mean |v| dt
    double first_energy = 0, first_shadow = 0;  // H₁ and S_h,1
    std::array<double, D> first_momentum{};
  } account_;
  Snapshot<D> shot_;                          // of the last slab's end
  Tail tail_;                                 // added to what is shown, not to H and its errors
  std::vector<Vec<D>> scratch_;               // for S_h
  std::optional<NeighbourList<D>> touching_;  // pairs that may overlap
  Particles<D> gathered_;                     // from the blocks of all ranks
};

}  // namespace carom
