// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A simulation that is built, run, inspected and continued step by step: the Python module's simulation, without
// Python.
//
// Between runs the session has a system at rest; Simulation::run() advances it to an end, and saves the state from
// which a later run() continues bit for bit like one undisturbed run (engine/run/state.h). A change of particles,
// forces or integrator drops that state: then a new run begins at time 0.

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

/// The data of N particles for add_particles(): N·D numbers for x; N·D or none for v; one or three for each particle or
/// none for spin; N, one or none for the other columns.
struct Columns {
  std::span<const double> x, v, radius, mass, charge, spin;
  std::string species;
  double inertia = 0;  ///< reduced, of the species; 0: as before, homogeneous if the species is new
};

/// Callbacks of run().
struct RunHooks {
  std::function<bool(const Statistics&)> stop;  ///< before each step; true: the run ends there
  std::function<void()> show;                   ///< at the intervals of the plan; the session then shows that time
  std::function<std::string()> deck;  ///< the present state as a deck, without files only the counts of particles
  std::string script;                 ///< the file of the program, which stands for a deck in the files
};

/// The averages that a run computes, by name.
using Averages = std::map<std::string, std::vector<TableColumn>>;

template <int D>
class Session {
 public:
  /// All members throw Error.
  Session(std::span<const double> edges, const std::vector<std::string>& boundary);
  /// The initial state of a deck, or a given state.
  explicit Session(Deck& deck, const std::optional<GivenState>& given = {}, const Pause& pause = {});
  /// The last checkpoint of a run that wrote files to a directory; the next run() continues the run and its files.
  Session(Deck& deck, Resumed& from);

  // Changes.
  void add_particles(const Columns& columns);
  void set_position(std::span<const double> x);
  /// In RunHooks::show at the end of a step this begins no new run: the velocities apply when show returns.
  void set_velocity(std::span<const double> v);
  void set_spin(std::span<const double> spin);
  /// The reduced moment of inertia of a species.
  void set_inertia(const std::string& species, double inertia);
  /// N velocities, drawn from the Maxwell–Boltzmann distribution for particles with a temperature (not NaN) [energy];
  /// the present velocities for the rest.
  std::vector<Vec<D>> drawn_velocities(std::span<const double> temperature, std::uint64_t seed);
  /// The same for spins and rotational temperatures.
  std::vector<Spin<D>> drawn_spins(std::span<const double> temperature, std::uint64_t seed);
  /// Adds a wall or changes one, which stays where it is.
  void add_wall(Parameters given);
  /// Sets the bath, in place of an earlier one.
  void set_bath(Parameters given);
  /// Changes its temperature; the next run() goes on.
  void set_bath_temperature(double temperature);
  /// Sets the law of contacts between two partners, which must be there already; the next run() goes on.
  void add_contact(Parameters given);
  void add_force(std::string_view type, Parameters given);
  void set_integrator(std::string_view name, Parameters given);
  /// Makes later runs write files: `set` overrides [output] of a deck, including the directory; thermo rows and
  /// calls of RunHooks::show come at this interval.
  void set_output(std::vector<std::string> set, double thermo_interval);

  /// Drops the settings of a deck for the run and its integrator, which must be set again.
  void forget_run() {
    plan_ = {};
    integrator_ = nullptr;
    parameters_ = {};
    text_.clear();
  }
  /// Whether run() will call RunHooks::deck.
  bool needs_deck() const { return text_.empty() && !begun(); }
  /// Whether the next run() continues one.
  bool begun() const { return shown_until_ >= 0; }
  /// Whether runs write files.
  bool writes_files() const { return output_.has_value(); }
  /// Runs to the end of the plan, counted in the time and steps of the whole run, so that a later end continues the
  /// run. The step of the plan is ignored.
  void run(Plan plan, const RunHooks& hooks);

  // The present state: in RunHooks::show at the time shown, else at the end of the last run.
  const Snapshot<D>& shot();
  const Statistics& statistics() const { return live_ ? *live_ : statistics_; }
  /// Views of all particles, valid during the life of the session.
  std::span<const Vec<D>> position() { return views_.position(); }
  std::span<const Vec<D>> velocity() { return views_.velocity(); }
  std::span<const Image<D>> image() { return views_.image(); }
  /// Empty if there never was a spin.
  std::span<const Spin<D>> spin() { return views_.spin(); }
  /// By species; 0 or missing: homogeneous.
  const std::vector<double>& inertias() const { return box_.contacts.inertias; }
  Constants constants() { return views_.constants(); }
  const Box<D>& box() const { return box_; }
  const std::vector<std::string>& species() const { return species_; }
  std::size_t size() const { return size_; }
  const IntegratorInfo* integrator() const { return integrator_; }
  const Parameters& integrator_parameters() const { return parameters_; }
  const std::vector<Force>& forces() const { return terms_.all(); }
  /// With the places of moving walls, and the phases of shaken ones, at the time of the present state.
  std::vector<Parameters> walls() const;
  const std::vector<Parameters>& contacts() const { return contacts_; }
  /// By name: the pressure on each face of the box that is a wall, and the force on each further wall, since the last
  /// row.
  std::map<std::string, double> wall_loads();
  /// None, or one. A ramp that has begun has its ramp_time.
  std::vector<Parameters> baths() const;
  /// During a run: only in RunHooks::show.
  Averages averages() const;
  /// Warnings of the last run.
  const std::vector<std::string>& warnings() const { return warnings_; }
  /// The directory of the files; empty: no files.
  std::string directory() const { return deck_ ? deck_->output.directory.string() : std::string(); }
  /// The keys of [output] that the deck gives, and its directory.
  const Parameters& deck_output() const { return deck_output_; }
  /// The plan of the deck; without a deck it has no end.
  const Plan& plan() const { return plan_; }

 private:
  class Shown;
  void change(const char* what);
  void need_state_at_end(const char* what) const;
  double present() const { return showing_ ? shot_->time : statistics().end_time; }
  void set_contacts(std::vector<Parameters> all);
  template <class T>
  void set(std::vector<T> Particles<D>::*member, std::span<const double> values, const char* what);
  bool reached(const Plan& plan) const;
  Bytes saved(const std::string& name, double interval) const;
  void rest(Particles<D>& particles);
  void warn(const RunRecord<D>* record);
  void warn_of_start(const RunHooks& hooks);
  void show(const Snapshot<D>& shot, const RunHooks& hooks);
  void describe(Plan& plan, bool begun, const RunHooks& hooks);
  void push(const Simulation<D>& run);
  void save(Simulation<D>& run, std::map<std::string, Bytes>& state, RunRecord<D>* record);

  Box<D> box_;
  std::vector<Parameters> walls_, contacts_, baths_;
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
  std::string failure_;  // why the last run failed

  std::optional<Snapshot<D>> shot_;
  Statistics statistics_;               // statistics of the last run
  const Statistics* live_ = nullptr;    // statistics of the active run
  std::map<std::string, Bytes> state_;  // to continue from
  std::int64_t state_steps_ = 0;
  double state_time_ = 0, interval_ = 0, step_ = 0;
  double shown_until_ = -1;

  bool showing_ = false;        // RunHooks::show is running
  bool at_step_end_ = false;    // RunHooks::show is called between two steps
  std::vector<Vec<D>> pushed_;  // new velocities, set by a callback

  std::optional<std::vector<std::string>> output_;  // overrides of [output]; nullopt: no files
  std::string text_, file_;                         // the deck that the particles came from, and its file
  std::optional<Deck> deck_;                        // deck of the run that writes files
  CheckpointHead head_;                             // positions in its files at the state to continue from
  std::shared_ptr<Checkpoint> checkpoint_;          // holds that state until the first run
  const RunRecord<D>* record_ = nullptr;            // record of the active run
  Averages averages_;
  std::vector<std::string> deck_warnings_, warnings_;  // of the start of a run; of a run
  bool warned_ = false;  // of this system; changes of velocities and spins are no reason to look again
  Parameters deck_output_;
};

}  // namespace carom::python
