// SPDX-License-Identifier: BSD-3-Clause
#include "io/python/session.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>

#include "engine/forces/add_interaction.h"
#include "engine/laws/bath_options.h"
#include "engine/laws/contact_options.h"
#include "engine/laws/wall_options.h"
#include "engine/run/measurement.h"
#include "engine/run/state.h"
#include "engine/run/step_choice.h"
#include "engine/setup/epoch.h"
#include "engine/setup/step_options.h"
#include "io/files/log_report.h"

namespace carom::python {
namespace {

using Clock = std::chrono::steady_clock;
double since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

[[noreturn]] void refuse(const std::string& what_and_remedy) { throw Error(Failure::deck, what_and_remedy); }

/// One value for all particles, or one per particle.
double value_of(std::span<const double> values, std::size_t i, double fallback) {
  return values.empty() ? fallback : values[values.size() == 1 ? 0 : i];
}

template <class T>
T row_of(std::span<const double> values, std::size_t i) {
  return Eigen::Map<const T>(values.data() + i * T::SizeAtCompileTime);
}

/// Rows of finite numbers.
template <class T>
std::vector<T> rows_of(std::span<const double> values, std::size_t count, const std::string& what) {
  std::vector<T> rows(count);
  for (std::size_t i = 0; i < count; ++i) {
    rows[i] = row_of<T>(values, i);
    if (!rows[i].allFinite())
      throw Error(Failure::initial_state,
                  what + ": those of particle " + std::to_string(i) + " are not finite; give finite numbers");
    for (const double each : rows[i])
      if (std::string error = beyond_limits(each); !error.empty())
        throw Error(Failure::initial_state,
                    error.insert(0, what + ": a number of particle " + std::to_string(i) + " "));
  }
  return rows;
}

/// Replaces the distance within which bonds were found by these bonds.
template <int D>
void set_bonds(Parameters& table, const Interaction<D>& term) {
  if (!table.has("within") || !term.bonds()) return;
  table.erase("within");
  table.set("pairs", *term.bonds());
}

}  // namespace

template <int D>
Session<D>::Session(const std::vector<double>& edges, const std::vector<std::string>& boundary) {
  std::ranges::copy(edges, box_.edges.begin());
  for (int k = 0; k < D; ++k) box_.boundary[k] = find_boundary(boundary[k]).boundary;
  system_->species.clear();
  system_->box = box_;
  system_->check();
  for (const TableSchema& table : deck_schema()) values_.tables[table.name];
  set("", {{"format", std::int64_t{1}}});
  set("system", {{"dimension", std::int64_t{D}}, {"boundary", boundary}});
  if (!edges.empty()) values_.find("system")->values.set("box", edges);
  views_.rest(system_->particles);
}

template <int D>
Session<D>::Session(Deck& deck, const std::optional<GivenState>& given, const Pause& pause) {
  system_ = build_system<D>(deck, nullptr, given ? &*given : nullptr, pause);
  plan_ = deck.plan;
  box_ = system_->box;
  values_ = deck.source->values;
  for (const char* const table : {"particles", "placement", "run", "output"}) values_.list(table).clear();
  for (std::size_t n = 0; n < system_->interactions.size(); ++n)
    set_bonds(values_.list("interaction")[n].values, *system_->interactions[n]);
  note_shear();
  species_ = system_->species;
  size_ = system_->size();
  text_ = deck.toml_text;
  warned_ = true;
  views_.rest(system_->particles);
}

/// To be called before any change.
template <int D>
void Session<D>::change(const std::string& what) {
  if (running_) refuse("a run is going on; " + what + " before it or after it");
  state_.clear();
  failure_.clear();
  shot_.reset();
  statistics_ = {};
  shown_until_ = -1;
  text_.clear();
  if (output_ && output_->empty()) output_.reset();  // no overrides: the files are of a continued run
  deck_.reset();
  checkpoint_.reset();
  averages_.clear();
  box_.restart();
  system_->box = box_;
}

template <int D>
void Session<D>::add_particles(const Columns& columns) {
  if (columns.inertia != 0) check_inertia(columns.inertia, D);
  change("add particles");
  warned_ = false;
  Particles<D>& all = system_->particles;
  const std::size_t before = size_, added = columns.x.size() / D, kinds = species_.size();
  const auto at = std::ranges::find(species_, columns.species);
  const auto kind = static_cast<std::uint16_t>(at - species_.begin());
  if (kind == kinds) {
    species_.push_back(columns.species);
    if (!values_.list("contact").empty()) set_contacts(values_.list("contact"));
  }
  system_->species = species_;
  views_.detach(all);
  const bool spins = !all.spin.empty() || !columns.spin.empty();
  const auto resize = [&](std::size_t n) {
    if (spins) all.spin.resize(n, Spin<D>::Zero());
    all.x.resize(n), all.v.resize(n), all.image.resize(n);
    all.mass.resize(n), all.radius.resize(n), all.charge.resize(n), all.species.resize(n);
    size_ = n;
  };
  const Box<D> box = box_;
  try {
    resize(before + added);
    const Particle<D> fallback{.x = Vec<D>::Zero()};
    for (std::size_t i = 0; i < added; ++i) {
      const std::size_t id = before + i;
      all.x[id] = row_of<Vec<D>>(columns.x, i);
      all.v[id] = columns.v.empty() ? fallback.v : row_of<Vec<D>>(columns.v, i);
      all.image[id] = {};
      all.mass[id] = value_of(columns.mass, i, fallback.mass);
      all.radius[id] = value_of(columns.radius, i, fallback.radius);
      all.charge[id] = value_of(columns.charge, i, fallback.charge);
      all.species[id] = kind;
      if (!columns.spin.empty()) all.spin[id] = row_of<Spin<D>>(columns.spin, i);
    }
    system_->check();
    for (const auto& [what, numbers] : {std::pair{"position", columns.x},
                                        {"velocity", columns.v},
                                        {"radius", columns.radius},
                                        {"charge", columns.charge}})
      for (const double each : numbers)
        if (const std::string error = beyond_limits(each); !error.empty())
          throw Error(Failure::initial_state, std::string("add_particles: a number in '") + what + "' " + error);
    if (columns.inertia != 0) set_inertia(columns.species, columns.inertia);
    if (!values_.list("step").empty()) set_pair_steps(values_.list("step"));
    system_->wrap(Failure::initial_state);
    make_terms(*system_);
  } catch (...) {
    resize(before);
    species_.resize(kinds);
    system_->box = box_ = box;
    system_->species = species_;
    system_->interactions.clear();
    throw;
  }
}

template <int D>
void Session<D>::set_position(std::span<const double> x) {
  set(&Particles<D>::x, x, "positions");
  warned_ = false;
  std::ranges::fill(system_->particles.image, Image<D>{});
  system_->wrap(Failure::initial_state);
}

template <int D>
void Session<D>::set_velocity(std::span<const double> v) {
  if (running_ && showing_ && std::this_thread::get_id() == runner_) {
    if (!at_step_end_)
      refuse(
          "velocities: an epoch of free flight is going on; choose epochs that end where the callback comes: "
          "integrator(\"free-flight\", step=every)");
    pushed_ = rows_of<Vec<D>>(v, size_, "velocities");
    return;
  }
  set(&Particles<D>::v, v, "velocities");
}

template <int D>
void Session<D>::set_spin(std::span<const double> spin) {
  if (system_ && system_->particles.spin.empty()) system_->particles.spin.resize(size_, Spin<D>::Zero());
  set(&Particles<D>::spin, spin, "spins");
}

template <int D>
void Session<D>::set_inertia(const std::string& species, double inertia) {
  check_inertia(inertia, D);
  const auto kind = static_cast<std::size_t>(std::ranges::find(species_, species) - species_.begin());
  change("set the inertia");
  auto& all = box_.contacts.inertias;
  if (all.size() <= kind) all.resize(kind + 1);
  all[kind] = inertia;
  system_->box = box_;
}

template <int D>
template <class T>
void Session<D>::set(std::vector<T> Particles<D>::*member, std::span<const double> values, const std::string& what) {
  change("set " + what);
  std::ranges::copy(rows_of<T>(values, size_, what), (system_->particles.*member).begin());
}

template <int D>
void Session<D>::take(Session& placed) {
  System<D>& system = *placed.system_;
  make_terms(system);  // if this throws, nothing has changed
  change("place particles");
  warned_ = false;
  const Box<D> before = std::exchange(box_, placed.box_);
  box_.contacts.inertias = before.contacts.inertias;
  box_.bath = before.bath;
  system.box = box_;
  views_.detach(system_->particles);
  system.particles.spin = std::move(system_->particles.spin);
  if (!system.particles.spin.empty()) system.particles.spin.resize(placed.size_, Spin<D>::Zero());
  system_ = std::move(placed.system_);
  views_.rest(system_->particles);
  species_ = placed.species_;
  size_ = placed.size_;
  values_.list("system") = placed.values_.list("system");
}

template <int D>
const IntegratorInfo* Session<D>::integrator() const {
  const ValueTable* table = values_.find("integrator");
  return table ? &find_integrator(table->variant->name) : nullptr;
}

template <int D>
std::vector<ValueTable> Session<D>::tables(const std::string& name) const {
  std::vector<ValueTable> all = values_.list(name);
  for (std::size_t k = 0; name == "wall" && k < all.size(); ++k) {
    WallOptions<D> now = box_.options[k];
    now.restart(present());
    all[k].values.set("moved", now.moved);
    all[k].values.set("phase", now.turns);
    if (all[k].values.has("until")) all[k].values.set("until", now.until);
  }
  const Bath& bath = (at_work_ ? at_work_->box : box_).bath;
  if (name == "bath" && bath.has_ramp() && !bath.needs_ramp_time())
    all[0].values.set("ramp_time", std::vector{bath.ramp_start, bath.ramp_end});
  return all;
}

template <int D>
void Session<D>::set(const std::string& name, Parameters given) {
  if (name == "wall") return set_wall(std::move(given));
  if (name == "contact") return add_contact(std::move(given));
  if (name == "step") return add_step(std::move(given));
  if (name == "interaction") return add_force(std::move(given));
  ValueTable table = table_of(name, std::move(given));
  if (name == "bath") {
    const Bath bath = bath_of(table.values);
    if (bath.friction.size() > 1 && bath.friction.size() != species_.size())
      refuse("'friction' has " + std::to_string(bath.friction.size()) + " numbers for " +
             std::to_string(species_.size()) + " species; give one number for all, or one for each");
    change("set a bath");
    system_->box.bath = box_.bath = bath;
  } else if (name == "integrator") {
    change("choose the integrator");
    warned_ = false;
  }
  values_.list(name) = {std::move(table)};
}

template <int D>
void Session<D>::set_wall(Parameters given) {
  if (running_) refuse("a run is going on; change walls before it or after it");
  std::vector<ValueTable> all = tables("wall");
  const auto* name = given.find<std::string>("name");
  const auto old =
      std::ranges::find_if(all, [&](const ValueTable& each) { return name && each.values.text("name") == *name; });
  if (old == all.end()) {
    all.push_back(table_of("wall", std::move(given)));
  } else {
    for (const char* const fixed : {"shape", "normal", "offset", "centre", "axis", "radius", "inside"})
      if (given.has(fixed))
        refuse("the wall '" + *name + "' is there already and stays where it is; leave '" + fixed +
               "' out, or give 'moved'");
    const bool stays = given.has("velocity") && !given.has("moved");
    Parameters changed = old->values;
    if (stays) changed.set("phase", 0.0), changed.set("moved", 0.0);
    if (given.has("velocity")) changed.erase("until");  // of the motion before
    for (const auto& [key, value] : given.all()) changed.set(key, value);
    *old = table_of("wall", std::move(changed));
    if (stays) {
      Box<D> box = box_;
      box.options.clear();
      add_wall(box, old->values);
      old->values.set("moved",
                      box_.options[old - all.begin()].displacement(present()) - box.options[0].displacement(0));
    }
  }
  Box<D> box = box_;
  box.restart();
  box.options.clear();
  for (const ValueTable& each : all) add_wall(box, each.values);
  change("add walls");
  warned_ = false;
  system_->box = box_ = box;
  values_.list("wall") = std::move(all);
  set_contacts(values_.list("contact"));
}

template <int D>
void Session<D>::set_shear(std::optional<std::vector<std::array<double, 2>>> rates, std::optional<double> new_tilt) {
  double before = -1;
  for (const auto& [time, rate] : rates.value_or(std::vector<std::array<double, 2>>{})) {
    if (!std::isfinite(rate)) refuse("the rate of shear is not finite; give a number");
    if (!(time >= 0 && time > before))
      refuse("the times of the rates of shear do not increase; give [[time, rate], …], the first time at least 0");
    before = time;
  }
  if (rates && rates->empty()) refuse("there is no rate of shear; give a number");
  const double tilt = new_tilt.value_or(box_.tilt);
  if (!(tilt >= 0 && tilt < box_.edges[0]))
    refuse("the tilt is not between 0 and the edge along x; add or take off edges");
  change("set the shear");
  if (rates) {
    const bool constant = rates->size() == 1 && rates->front()[0] == 0;
    box_.shear_rate = rates->front()[1];
    box_.shear_rates = constant ? std::vector<std::array<double, 2>>{} : *rates;
    box_.begin_step(0, 0);
  }
  box_.tilt = tilt;
  system_->box = box_;
  note_shear();
}

/// Writes the present and future rates of shear and the present tilt into the values, from which decks are made.
template <int D>
void Session<D>::note_shear() {
  Parameters& of_system = values_.find("system")->values;
  for (const char* const key : {"shear", "tilt"}) of_system.erase(key);
  if (box_.tilt != 0) of_system.set("tilt", box_.tilt);
  std::vector<std::vector<double>> rates;
  for (const auto& [from, rate] : box_.shear_rates) {
    if (box_.reached(from, box_.time)) rates.clear();
    rates.push_back({std::max(0.0, from - box_.time), rate});
  }
  if (!rates.empty())
    of_system.set("shear", TableValue{{"rate", rates}});
  else if (box_.shear_rate != 0)
    of_system.set("shear", TableValue{{"rate", box_.shear_rate}});
}

template <int D>
void Session<D>::add_contact(Parameters given) {
  if (running_) refuse("a run is going on; change the laws of contacts before it or after it");
  auto all = values_.list("contact");
  all.push_back(table_of("contact", std::move(given)));
  const bool rough = box_.contacts.rough();
  need_state_at_end("a law of contacts");
  set_contacts(std::move(all));
  if (shown_until_ < 0 || box_.contacts.rough() != rough) change("add contacts");
}

/// To be called before a change that lets the run go on: the state from which it continues must be the present one.
template <int D>
void Session<D>::need_state_at_end(const char* what) const {
  if (shown_until_ < 0 || std::abs(state_time_ - statistics_.end_time) <= 1e-9 * step_) return;
  refuse(
      std::string(what) + ": the last run ended at time " + short_text(statistics_.end_time) +
      ", within a step or an epoch of free flight; end runs at whole steps, for example by integrator(\"free-flight\", "
      "step=…)");
}

/// Sets these laws for the present species and walls.
template <int D>
void Session<D>::set_contacts(std::vector<ValueTable> all) {
  Box<D> box = box_;
  box.contacts = {};
  box.contacts.inertias = box_.contacts.inertias;
  for (const ValueTable& each : all) carom::add_contact<D>(box, species_, each.values);
  system_->box = box_ = box;
  values_.list("contact") = std::move(all);
}

template <int D>
void Session<D>::add_step(Parameters given) {
  if (running_) refuse("a run is going on; add steps before it or after it");
  if (size_ == 0) refuse("step: there are no particles yet; call add_particles() first");
  auto all = values_.list("step");
  all.push_back(table_of("step", std::move(given)));
  find_step_bonds<D>(all.back().values, {.box = box_, .particles = system_->particles, .species = species_});
  set_pair_steps(std::move(all));
  change("add steps");
}

/// Sets these steps for the present species and particles.
template <int D>
void Session<D>::set_pair_steps(std::vector<ValueTable> all) {
  Box<D> box = box_;
  box.steps = {};
  for (const ValueTable& each : all) carom::add_step<D>(box, species_, size_, each.values);
  system_->box = box_ = box;
  values_.list("step") = std::move(all);
}

template <int D>
void Session<D>::add_force(Parameters given) {
  if (given.text("type") == "table")
    if (const std::string wrong = read_points(given, {}, read_text); !wrong.empty()) refuse("table: " + wrong);
  ValueTable table = table_of("interaction", std::move(given));
  if (size_ == 0) refuse(table.variant->name + ": there are no particles yet; call add_particles() first");
  change("add forces");
  warned_ = false;
  auto& all = values_.list("interaction");
  all.push_back(std::move(table));
  try {
    make_terms(*system_);
  } catch (...) {
    all.pop_back();
    throw;
  }
}

/// Replaces the terms of V of a system, which has none if this throws. Bonds found in the first one are kept.
template <int D>
void Session<D>::make_terms(System<D>& system) {
  system.interactions.clear();
  system.quanta = {};
  try {
    for (const bool bonded : {true, false})  // bonds first, since other terms may exclude bonded pairs
      for (ValueTable& table : values_.list("interaction")) {
        const InteractionInfo& info = find_interaction(table.variant->name);
        if ((info.kind == InteractionInfo::Kind::bonded) != bonded) continue;
        add_interaction(system, info, table.of_variant());
        set_bonds(table.values, *system.interactions.back());
      }
  } catch (...) {
    system.interactions.clear();
    throw;
  }
}

/// Whether the state that a run would continue from is at this end already.
template <int D>
bool Session<D>::reached(const Plan& plan) const {
  const Statistics& s = statistics_;
  return (plan.steps && state_steps_ >= *plan.steps) ||
         (plan.end_time && s.end_time >= *plan.end_time - 1e-9 * step_) ||
         (plan.collisions && s.counters.sphere_sphere >= *plan.collisions);
}

/// A part of the saved state, with the next due times recomputed if the interval has changed.
template <int D>
Bytes Session<D>::saved(const std::string& name, double interval) const {
  if (checkpoint_) return checkpoint_->read(name);
  if ((name != "next frame" && name != "next row") || interval == interval_ || interval == 0) return state_.at(name);
  auto next = static_cast<std::int64_t>(std::floor((state_time_ + 1e-9 * step_) / interval)) + 1;
  Archive out;
  out(next);
  return out.bytes();
}

template <int D>
void Session<D>::run(Plan plan, const RunHooks& hooks) {
  if (running_) refuse("a run is going on; wait for its end");
  const IntegratorInfo* const method = integrator();
  if (method == nullptr) refuse("there is no integrator; call integrator(name, step=…) first");
  if (size_ == 0) refuse("there are no particles; call add_particles() first");
  if (!failure_.empty())
    refuse("the last run has failed (" + failure_ + "); give positions, velocities or an integrator to start anew");
  const bool begun = this->begun();
  if (begun && reached(plan))
    refuse("the run is at time " + short_text(statistics_.end_time) + ", step " + std::to_string(statistics_.steps) +
           " already; give a later end, or change something to start anew");
  if (system_->interactions.empty()) make_terms(*system_);
  deck_warnings_.clear();
  warnings_.clear();
  if (output_)
    describe(plan, begun, hooks);
  else if (!begun && !std::exchange(warned_, true))
    warn_of_start();
  warnings_ = deck_warnings_;
  Parameters parameters = values_.find("integrator")->of_variant();
  choose_step(*system_, *method, plan, parameters, begun ? step_ : 0);
  step_ = parameters.real("step");
  const double interval = plan.thermo_interval;

  std::optional<Simulation<D>> made;  // if this throws, the session keeps its system
  if (begun) {
    parameters = completed(method->name, method->parameters, std::move(parameters));
    set_steps(plan, parameters);
    made.emplace(std::move(system_), *method, method->make<D>(parameters), plan);
  } else {
    made.emplace(std::move(system_), *method, std::move(parameters), plan);
  }
  Simulation<D>& run = *made;
  hooks_ = &hooks;
  at_work_ = &run.system();
  live_ = &run.statistics();
  views_.lend(at_work_->particles);
  running_ = true;
  runner_ = std::this_thread::get_id();
  std::map<std::string, Bytes> state;
  auto last_checkpoint = Clock::now();
  typename Simulation<D>::Hooks inner;
  inner.leave = inner.leave_here = [&] { return hooks.stop && hooks.stop(run.statistics()); };
  inner.should_stop = [&] {
    const bool pushed = !pushed_.empty();
    if (pushed) push(run);
    const bool stop = hooks.stop && hooks.stop(run.statistics());
    // After a velocity change at the very end, the state before the last, shortened step is useless.
    if (stop || run.is_last_on_the_way() || (pushed && run.statistics().fraction_done >= 1))
      save(run, state);
    else if (record_ && deck_->output.checkpoint_wall && since(last_checkpoint) >= *deck_->output.checkpoint_wall) {
      record_->checkpoint();
      last_checkpoint = Clock::now();
    }
    return stop;
  };
  if (begun)
    inner.restore = [&] {
      restore_state(*at_work_, [&](const std::string& name) { return saved(name, interval); });
      state_.clear();
      checkpoint_.reset();
    };
  bool started = false;
  const auto end = [&] {
    warnings_ = deck_warnings_;
    if (record_)
      warnings_.insert(warnings_.end(), record_->warnings().begin(), record_->warnings().end());
    else
      std::ranges::move(warnings_about(*live_, *integrator(), box_), std::back_inserter(warnings_));
    if (started) {
      statistics_ = *live_;
      if (shot_ && std::abs(shot_->time - statistics_.end_time) <= 1e-9 * step_) shot_->time = statistics_.end_time;
      shown_until_ = std::max(shown_until_, statistics_.end_time);
      averages_ = averages();
    }
    live_ = nullptr;
    record_.reset();
    pushed_.clear();
    rest(at_work_->particles);
  };
  try {
    if (deck_)
      record_.emplace(*deck_, run, RecordOptions{.from = begun ? &head_ : nullptr, .continued = begun, .silent = true});
    run.add(*this);
    started = true;
    run.run(inner);
    if (record_) record_->close();
  } catch (const std::exception& e) {
    if (record_) record_->fail(e.what());
    if (started) failure_ = e.what();
    end();
    throw;
  }
  end();
  state_ = std::move(state);
  interval_ = interval;
}

/// The system between runs.
template <int D>
void Session<D>::rest(Particles<D>& particles) {
  for (auto* each : {&particles.x, &particles.v}) each->resize(size_, Vec<D>::Zero());  // if free flight has failed
  box_.time = statistics_.end_time;
  box_.tilt = at_work_->box.tilt;
  box_.shear_rate = box_.shear_rate_at(box_.time);
  note_shear();
  box_.bath = at_work_->box.bath;  // with the times of its ramp
  system_ = std::make_unique<System<D>>();
  system_->box = box_;
  system_->species = species_;
  views_.rest(std::move(particles), system_->particles);
  at_work_ = nullptr;
  running_ = false;
}

template <int D>
void Session<D>::thermo(const Snapshot<D>& shot) {
  shot_ = shot;
  shot_->particles = nullptr;
  at_step_end_ = shot.particles == &at_work_->particles;
  views_.show(*shot.particles);
  showing_ = true;
  if (hooks_->show && shot.time > shown_until_) hooks_->show();
  showing_ = false;
  views_.hide();
}

template <int D>
const Snapshot<D>& Session<D>::shot() {
  if (shot_) return *shot_;
  if (running_) refuse("a run is just beginning; look at it in its callback, or after it");
  if (system_->interactions.empty()) make_terms(*system_);
  System<D>& system = *system_;
  system.count_moving();
  system.quanta = quanta(system);
  const Measurement<D> now = measure(system, system.particles, system.particles,
                                     evaluate_energy<D>(system, system.particles.x), tail_of(system));
  shot_ = now.shot;
  shot_->pressure = pressure_of(now.virial, box_, box_.time);
  shot_->time = statistics_.end_time;
  shot_->step = statistics_.steps;
  shot_->collisions = statistics_.counters.sphere_sphere;
  shot_->max_energy_error = statistics_.max_energy_error;
  return *shot_;
}

template <int D>
std::map<std::string, double> Session<D>::wall_loads() {
  std::map<std::string, double> loads;
  for (const WallLoad& each : shot().walls) loads[box_.name_of(each.number)] += each.load();
  return loads;
}

template class Session<2>;
template class Session<3>;

}  // namespace carom::python
