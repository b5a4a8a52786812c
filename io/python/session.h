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
#include <thread>
#include <vector>

#include "engine/run/simulation.h"
#include "io/command/resume.h"
#include "io/deck/deck.h"
#include "io/files/run_record.h"
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
  std::function<std::string()> deck;            ///< the present state as a deck, where the run is to leave files
};

/// The averages that a run takes, by name.
using Averages = std::map<std::string, std::vector<TableColumn>>;

template <int D>
class Session {
 public:
  /// All members throw Error.
  Session(std::span<const double> edges, const std::vector<std::string>& boundary);
  explicit Session(Deck& deck);
  /// A run that left its files in a directory, as its last checkpoint has it; the next run() goes on with it and them.
  Session(Deck& deck, Resumed& from);

  // Changes.
  void add_particles(const Columns& columns);
  void set_position(std::span<const double> x);
  /// In RunHooks::show, at the end of a step, without a new beginning: then they hold from the return on.
  void set_velocity(std::span<const double> v);
  /// Velocities of Maxwell and Boltzmann for the particles that have a temperature (not NaN) [energy], N of them; the
  /// present ones for the rest.
  std::vector<Vec<D>> drawn_velocities(std::span<const double> temperature, std::uint64_t seed);
  void add_force(std::string_view type, Parameters given);
  void set_integrator(std::string_view name, Parameters given);
  /// From the next run on there are files: `set` overrides the [output] of decks, directory and all; rows of thermo,
  /// and with them RunHooks::show, come at this interval.
  void set_output(std::vector<std::string> set, double thermo_interval);

  /// What a deck said of the run and its integrator is to be said anew.
  void forget_run() {
    plan_ = {};
    integrator_ = nullptr;
    parameters_ = {};
    text_.clear();
  }
  /// Whether run() will call RunHooks::deck.
  bool needs_deck() const { return output_ && text_.empty() && shown_until_ < 0; }
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
  /// While a run goes on: in RunHooks::show.
  Averages averages() const;
  /// Of the last run: about its files.
  const std::vector<std::string>& warnings() const { return warnings_; }
  /// Where the files are; empty: there are none.
  std::string directory() const { return deck_ ? deck_->output.directory.string() : std::string(); }
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
  void describe(Plan& plan, bool begun, const RunHooks& hooks);
  void push(const Simulation<D>& run);
  void save(Simulation<D>& run, std::map<std::string, Bytes>& state, RunRecord<D>* record);

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
  std::thread::id runner_;  // the thread in run(), in which callbacks may set velocities
  ParticleViews<D> views_;
  std::string failure_;  // of the last run

  std::optional<Snapshot<D>> shot_;
  Statistics statistics_;               // of the last run
  const Statistics* live_ = nullptr;    // of the one that is going on
  std::map<std::string, Bytes> state_;  // to go on from
  std::int64_t state_steps_ = 0;
  double state_time_ = 0, interval_ = 0, step_ = 0;
  double shown_until_ = -1;

  bool showing_ = false;        // RunHooks::show is at work
  bool at_step_end_ = false;    // and shows the particles between two steps
  std::vector<Vec<D>> pushed_;  // velocities that are to hold from now on

  std::optional<std::vector<std::string>> output_;  // overrides; else there are no files
  std::string text_, file_;                         // of the deck that the particles came from, and its name
  std::optional<Deck> deck_;                        // of the run that leaves files
  CheckpointHead head_;                             // where its files were at the state to go on from
  std::shared_ptr<Checkpoint> checkpoint_;          // which has that state, until the first run
  const RunRecord<D>* record_ = nullptr;            // of the run that is going on
  Averages averages_;
  std::vector<std::string> warnings_;
};

}  // namespace carom::python
