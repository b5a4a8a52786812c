// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A simulation that is built, run, inspected and continued step by step: the Python module's simulation, without
// Python. It holds the tables of a deck, which are set one by one, and the particles as a state.
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
#include "io/deck/deck_source.h"
#include "io/files/run_record.h"
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
  std::string script;                           ///< the file of the program, which stands for a deck in the files
};

/// The averages that a run computes, by name.
using Averages = std::map<std::string, std::vector<TableColumn>>;

template <int D>
class Session : Observer<D> {
 public:
  /// All members throw Error.
  /// Without particles. No edges: take() will bring them.
  Session(const std::vector<double>& edges, const std::vector<std::string>& boundary);
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
  /// Draws velocities from the Maxwell–Boltzmann distribution, or spins, for the particles with a temperature (not NaN)
  /// [energy]; the rest keep theirs.
  void draw(std::span<const double> temperature, std::uint64_t seed, bool spins);
  /// Sets a table of the deck: the title and the description; the bath or the integrator, in place of an earlier one; a
  /// wall, added or changed, which then stays where it is; a further force; a further law of contacts between partners
  /// that are there already, with which the next run() goes on.
  void set(const std::string& table, Parameters given);
  /// Changes the temperature of the bath; the next run() goes on.
  void set_bath_temperature(double temperature);
  /// Takes over the particles and the box of a session, which must not be used then. Its first particles are those of
  /// this session, and walls and contacts are the same.
  void take(Session& placed);
  /// Makes later runs write files: `set` overrides [output] of a deck, including the directory; thermo rows and
  /// calls of RunHooks::show come at this interval.
  void set_output(std::vector<std::string> set, double thermo_interval);

  /// Whether the next run() continues one.
  bool begun() const { return shown_until_ >= 0; }
  /// Runs to the end of the plan, counted in the time and steps of the whole run, so that a later end continues the
  /// run. The step of the plan is ignored.
  void run(Plan plan, const RunHooks& hooks);

  // The present state: in RunHooks::show at the time shown, else at the end of the last run.
  const Snapshot<D>& shot();
  const Statistics& statistics() const { return live_ ? *live_ : statistics_; }
  /// Valid during the life of the session.
  ParticleViews<D>& views() { return views_; }
  /// By species; 0 or missing: homogeneous.
  const std::vector<double>& inertias() const { return box_.contacts.inertias; }
  const std::vector<std::string>& species() const { return species_; }
  /// Shears the box with these rates from these times on (Box::shear_rates), counted from the present, and sets the
  /// tilt; what is not given stays. A rate of 0 ends the flow.
  void set_shear(std::optional<std::vector<std::array<double, 2>>> rates, std::optional<double> tilt);
  /// The rate of shear at the present time, also during a run [1/time].
  double shear_rate() const { return (at_work_ ? at_work_->box : box_).shear_rate; }
  /// The tilt of the lattice of images (Box), also during a run [length].
  double tilt() const { return (at_work_ ? at_work_->box : box_).tilt; }
  std::size_t size() const { return size_; }
  /// Null if there is none yet.
  const IntegratorInfo* integrator() const;
  /// The tables of this name, with the places of moving walls, the phases of shaken ones and the times of a ramp that
  /// has begun, at the time of the present state.
  std::vector<ValueTable> tables(const std::string& name) const;
  /// The present state as a deck, without the images and [run]; `of` is what needs it, for messages.
  DeckValues deck(const std::string& of);
  /// By name: the pressure on each face of the box that is a wall, and the force on each further wall, since the last
  /// row.
  std::map<std::string, double> wall_loads();
  /// During a run: only in RunHooks::show.
  Averages averages() const;
  /// Warnings of the last run.
  const std::vector<std::string>& warnings() const { return warnings_; }
  /// The directory of the files; empty: no files.
  std::string directory() const { return deck_ ? deck_->output.directory.string() : std::string(); }
  /// The plan of the deck; without a deck it has no end.
  const Plan& plan() const { return plan_; }

 private:
  void change(const std::string& what);
  void need_state_at_end(const char* what) const;
  double present() const { return showing_ ? shot_->time : statistics().end_time; }
  void set_wall(Parameters given);
  void add_contact(Parameters given);
  void note_shear();
  void add_step(Parameters given);
  void set_pair_steps(std::vector<ValueTable> all);
  void add_force(Parameters given);
  void set_contacts(std::vector<ValueTable> all);
  void make_terms(System<D>& system);
  template <class T>
  void set(std::vector<T> Particles<D>::*member, std::span<const double> values, const std::string& what);
  bool reached(const Plan& plan) const;
  Bytes saved(const std::string& name, double interval) const;
  void rest(Particles<D>& particles);
  void warn_of_start();
  void thermo(const Snapshot<D>& shot) override;
  void describe(Plan& plan, bool begun, const RunHooks& hooks);
  void push(const Simulation<D>& run);
  void save(Simulation<D>& run, std::map<std::string, Bytes>& state);

  Box<D> box_;
  DeckValues values_;  // without particles, [placement], [run] and [output]; bonds that were found are pairs
  std::vector<std::string> species_;
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

  const RunHooks* hooks_ = nullptr;  // of the active run
  bool showing_ = false;             // RunHooks::show is running
  bool at_step_end_ = false;         // RunHooks::show is called between two steps
  std::vector<Vec<D>> pushed_;       // new velocities, set by a callback

  std::optional<std::vector<std::string>> output_;  // overrides of [output]; nullopt: no files
  std::string text_;                                // the deck that the particles are of; empty: of none
  std::optional<Deck> deck_;                        // deck of the run that writes files
  CheckpointHead head_;                             // positions in its files at the state to continue from
  std::shared_ptr<Checkpoint> checkpoint_;          // holds that state until the first run
  std::optional<RunRecord<D>> record_;              // of the active run
  Averages averages_;
  std::vector<std::string> deck_warnings_, warnings_;  // of the start of a run; of a run
  bool warned_ = false;  // of this system; changes of velocities and spins are no reason to look again
};

}  // namespace carom::python
