// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A simulation that is made, run, looked at and run on step by step: what the Python module offers, without Python.
//
// Between runs the session has a system at rest; Simulation::run() advances it to an end, and saves the state from
// which a later run() goes on with the bits of one undisturbed run (engine/run/state.h). A change of particles, forces
// or integrator drops that state: then a new run begins at time 0.

#include <atomic>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "engine/run/simulation.h"
#include "io/deck/deck.h"
#include "io/python/terms.h"
#include "io/python/views.h"

namespace carom::python {

/// What add_particles() takes of N particles: N·D numbers for x; as many or none for v; N, one or none for the others.
struct Columns {
  std::span<const double> x, v, radius, mass, charge;
  std::string species;
};

/// What the caller of run() does meanwhile.
struct RunHooks {
  std::function<bool(const Statistics&)> stop;  ///< before each step; true: the run ends there
  std::function<void()> show;                   ///< at the intervals of the plan; the session then is at that time
};

template <int D>
class Session {
 public:
  /// All members throw Error.
  Session(std::span<const double> edges, const std::vector<std::string>& boundary);
  explicit Session(Deck& deck);

  // Changes.
  void add_particles(const Columns& columns);
  void set_position(std::span<const double> x);
  void set_velocity(std::span<const double> v);
  void add_force(std::string_view type, Parameters given);
  void set_integrator(std::string_view name, Parameters given);

  /// To the end of the plan, in the time and steps of the whole run, so that a later end goes on. The step of the plan
  /// is ignored.
  void run(Plan plan, const RunHooks& hooks);

  // What there is now: in RunHooks::show at the time shown, else at the end of the last run.
  const Snapshot<D>& shot();
  const Statistics& statistics() const { return live_ ? *live_ : statistics_; }
  /// Views of all particles; they stay good while the session lives.
  std::span<const Vec<D>> position() { return views_.position(); }
  std::span<const Vec<D>> velocity() { return views_.velocity(); }
  std::span<const Image<D>> image() { return views_.image(); }
  Constants constants() { return views_.constants(); }
  const Box<D>& box() const { return box_; }
  const std::vector<std::string>& species() const { return species_; }
  std::size_t size() const { return size_; }
  const IntegratorInfo* integrator() const { return integrator_; }
  const Parameters& integrator_parameters() const { return parameters_; }
  const std::vector<Force>& forces() const { return terms_.all(); }
  /// The plan of the deck; without one there is no end in it.
  const Plan& plan() const { return plan_; }

 private:
  class Shown;
  void change(const char* what);
  void set(std::vector<Vec<D>> Particles<D>::*member, std::span<const double> values, const char* what);
  bool reached(const Plan& plan) const;
  Bytes saved(const std::string& name, double interval) const;
  void rest(Particles<D>& particles);
  void show(const Snapshot<D>& shot, const RunHooks& hooks);

  Box<D> box_;
  std::vector<std::string> species_;
  Terms<D> terms_;
  const IntegratorInfo* integrator_ = nullptr;
  Parameters parameters_;
  Plan plan_;

  std::unique_ptr<System<D>> system_ = std::make_unique<System<D>>();  // at rest; null while running
  System<D>* at_work_ = nullptr;
  std::size_t size_ = 0;
  std::atomic<bool> running_ = false;
  ParticleViews<D> views_;
  std::string failure_;  // of the last run

  std::optional<Snapshot<D>> shot_;
  Statistics statistics_;               // of the last run
  const Statistics* live_ = nullptr;    // of the one that is going on
  std::map<std::string, Bytes> state_;  // to go on from
  std::int64_t state_steps_ = 0;
  double state_time_ = 0, interval_ = 0, step_ = 0;
  double shown_until_ = -1;
};

}  // namespace carom::python
