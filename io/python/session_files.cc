// SPDX-License-Identifier: BSD-3-Clause
// The files of a session's runs: their deck, their state, the averages.

#include <regex>

#include "engine/setup/placement.h"
#include "io/deck/validate_state.h"
#include "io/python/session.h"

namespace carom::python {
namespace {

[[noreturn]] void refuse(const std::string& what_and_remedy) { throw Error(Failure::deck, what_and_remedy); }

/// The particles with a temperature (not NaN), and their temperatures.
std::pair<std::vector<Id>, std::vector<double>> heated(std::span<const double> temperature) {
  std::pair<std::vector<Id>, std::vector<double>> all;
  for (Id i = 0; i < temperature.size(); ++i) {
    if (std::isnan(temperature[i])) continue;
    if (!(temperature[i] >= 0) || std::isinf(temperature[i]))
      refuse("thermalize: the temperature of particle " + std::to_string(i) + " is " + short_text(temperature[i]) +
             "; give 0 or more");
    all.first.push_back(i);
    all.second.push_back(temperature[i]);
  }
  return all;
}

/// Changes the end of a deck's run, in the resolved deck too.
void set_ends(Deck& deck, const Plan& plan) {
  deck.plan.steps = plan.steps;
  deck.plan.end_time = plan.end_time;
  deck.plan.collisions = plan.collisions;
  auto& values = deck.source->values.find("run")->values;
  for (const char* key : {"steps", "end_time", "collisions"}) values.erase(key);
  if (plan.steps) values.set("steps", *plan.steps);
  if (plan.end_time) values.set("end_time", *plan.end_time);
  if (plan.collisions) values.set("collisions", static_cast<std::int64_t>(*plan.collisions));
  deck.toml_text = write_deck(deck.source->values);
}

/// Changes a value of a run's state by its name.
template <class T>
void change_value(const Fields& fields, const std::string& name, const std::function<void(T&)>& change) {
  for (const Fields::OfRun& entry : fields.of_run()) {
    if (entry.name != name) continue;
    Archive out;
    entry.archive(out);
    Archive in(out.bytes());
    T value{};
    in(value);
    change(value);
    Archive changed;
    changed(value);
    Archive back(changed.bytes());
    entry.archive(back);
  }
}

/// An error or warnings without their places, which are those of a deck that the session has written.
std::string without_places(const std::string& text) {
  static const std::regex places("(^|\n)[^\n]*?: (error|warning): ");
  return std::regex_replace(text, places, "$1");
}

/// Vectors as a value of a deck.
template <class T>
std::vector<std::vector<double>> rows_of(std::span<const T> all) {
  std::vector<std::vector<double>> rows;
  for (const T& each : all) rows.emplace_back(each.begin(), each.end());
  return rows;
}

}  // namespace

template <int D>
Session<D>::Session(Deck& deck, Resumed& from)
    : Session(deck, GivenState{from.reader(), from.head.bonds, from.head.time}) {
  text_.clear();
  system_->quanta = {};
  Archive(from.checkpoint->read("statistics"))(statistics_);
  checkpoint_ = std::make_shared<Checkpoint>(std::move(*from.checkpoint));
  head_ = from.head;
  state_time_ = shown_until_ = statistics_.end_time;
  state_steps_ = statistics_.steps;
  step_ = deck.plan.step;
  interval_ = deck.plan.thermo_interval;
  output_.emplace();
  deck_ = deck;
}

template <int D>
DeckValues Session<D>::deck(const std::string& of) {
  const auto x = views_.position(), v = views_.velocity();
  const Constants all = views_.constants();
  if (!std::ranges::is_sorted(all.species))
    refuse(of +
           ": the particles of a species do not follow one another, which a deck needs; add species after species");
  DeckValues values = values_;
  for (const char* const table : {"wall", "bath"}) values.list(table) = tables(table);
  for (ValueTable& bath : values.list("bath"))
    if (const auto* ramp = bath.find<std::vector<double>>("ramp_time"))
      bath.values.set("ramp_time", std::vector{ramp->front() - present(), ramp->back() - present()});
  for (std::size_t begin = 0, n = 0; begin < size_; begin += n) {
    const std::uint16_t kind = all.species[begin];
    n = static_cast<std::size_t>(std::ranges::upper_bound(all.species, kind) - all.species.begin()) - begin;
    const auto column = [&](std::span<const double> each) {
      return std::vector(each.begin() + begin, each.begin() + begin + n);
    };
    Parameters species{{"name", species_[kind]}, {"position", rows_of(x.subspan(begin, n))}};
    const std::vector<double> mass = column(all.mass);
    const auto fixed = std::ranges::count_if(mass, [](double each) { return std::isinf(each); });
    if (fixed > 0 && fixed < std::ssize(mass))
      refuse(of + ": some particles of the species '" + species_[kind] +
             "' are fixed, and others move, which a deck "
             "cannot say; give the fixed ones a species of their own");
    if (fixed > 0) {
      species.set("fixed", true);
    } else {
      species.set("mass", mass);
      species.set("velocity", rows_of(v.subspan(begin, n)));
    }
    const bool points = integrator() && !integrator()->hard_cores;
    species.set(points ? "display_radius" : "radius", column(all.radius));
    species.set("charge", column(all.charge));
    if (box_.contacts.rough()) {
      if (system_) system_->particles.spin.resize(size_, Spin<D>::Zero());
      species.set("spin", rows_of(views_.spin().subspan(begin, n)));
      if (kind < inertias().size() && inertias()[kind] != 0) species.set("inertia", inertias()[kind]);
    }
    values.list("particles").push_back(table_of("particles", std::move(species)));
  }
  return values;
}

template <int D>
void Session<D>::set_output(std::vector<std::string> set, double thermo_interval) {
  const std::string text = text_;
  change("choose the output");
  text_ = text;  // still the deck of these particles
  output_ = std::move(set);
  plan_.thermo_interval = thermo_interval;
}

/// Makes the deck of the run that is about to begin or continue, and sets the plan's output intervals from the deck.
template <int D>
void Session<D>::describe(Plan& plan, bool begun, const RunHooks& hooks) {
  if (!begun) {
    const auto placing = [&] {
      if (hooks.stop && hooks.stop(statistics_))
        throw Error(Failure::interrupted, "stopped while the particles were placed; no file was written");
    };
    const bool own = text_.empty();
    const std::filesystem::path file = own ? hooks.script : values_.file;
    try {
      const std::string text = own ? write_deck(this->deck("run")) : text_;
      std::vector<std::string> set = *output_;
      if (own) set.emplace_back("run.steps=1");  // until set_ends()
      Deck deck = read_deck(file, set, [&](const std::filesystem::path& path) {
        return path == file ? std::optional(text) : read_text(path);
      });
      set_ends(deck, plan);
      build_system<D>(deck, nullptr, nullptr, placing);
      if (own) {
        for (std::string& each : deck.warnings) each = "warning: " + without_places(each);
        if (!std::exchange(warned_, true)) deck_warnings_ = deck.warnings;
      }
      deck_ = std::move(deck);
    } catch (const Error& error) {
      if (!own) throw;
      throw Error(error.failure(), without_places(error.what()));
    }
  } else {
    for (const char* const changed : {"contact", "bath"}) deck_->source->values.list(changed) = tables(changed);
    set_ends(*deck_, plan);
  }
  const Plan& of = deck_->plan;
  if (hooks.show && plan.thermo_interval > 0 && plan.thermo_interval != of.thermo_interval)
    refuse("run: 'every' is " + short_text(plan.thermo_interval) +
           (of.thermo_interval > 0
                ? ", but the rows of thermo.csv come every " + short_text(of.thermo_interval) +
                      "; the callback is called with each row: leave 'every' out, or give output() that thermo_interval"
                : ", but output() got no thermo_interval, so that thermo.csv has its first and its last row only; the "
                  "callback is called with each row: give output() that thermo_interval"));
  plan = of;
  plan.step = 0;  // that of the integrator
}

/// Finds the warnings that a deck of this simulation would get before its run, on a copy of the system. There are none
/// if no deck can say what the simulation is: only a run with files must be a deck.
template <int D>
void Session<D>::warn_of_start() {
  Problems problems, of_deck;
  try {
    Deck deck;
    interpret(values_, read_text, deck, of_deck);  // without the particles
    System<D> copy;
    copy.box = box_;
    copy.species = species_;
    copy.particles = system_->particles;
    copy.need_spins();
    make_terms(copy);
    warn_of_state(deck, copy, problems);
  } catch (const Error&) {
    return;
  }
  for (const std::string& each : problems.warnings()) deck_warnings_.push_back("warning: " + without_places(each));
}

/// Sets the velocities from a callback, between two steps. The added energy counts as work, like that of moving walls,
/// not as an error of H; the error of momentum is unknown from then on. After a shortened step, steps are counted from
/// there.
template <int D>
void Session<D>::push(const Simulation<D>& run) {
  Particles<D>& p = at_work_->particles;
  for (Id i = 0; i < p.size(); ++i)
    if (p.fixed(i) && pushed_[i] != Vec<D>::Zero())
      refuse("velocities: particle " + std::to_string(i) + " is fixed; give it the velocity 0");
  change_value<Statistics>(at_work_->fields, "statistics", [&](Statistics& s) {
    for (Id i = 0; i < p.size(); ++i)
      s.counters.work.add(0.5 * moving_mass(p.mass[i]) * (pushed_[i].squaredNorm() - p.v[i].squaredNorm()));
    s.max_momentum_error.reset();
  });
  p.v = std::exchange(pushed_, {});
  const StepCount now{run.statistics().steps, run.statistics().end_time};
  change_value<StepCount>(at_work_->fields, "step count", [&](StepCount& count) {
    if (count.time + static_cast<double>(now.steps - count.steps) * step_ + count.within != now.time) count = now;
  });
}

/// Saves the state to continue from, in memory and with the files.
template <int D>
void Session<D>::save(Simulation<D>& run, std::map<std::string, Bytes>& state) {
  state.clear();
  save_state(*at_work_, into(state));
  state_time_ = run.statistics().end_time;
  state_steps_ = run.statistics().steps;
  if (record_) head_ = record_->checkpoint();
}

template <int D>
Averages Session<D>::averages() const {
  if (!record_) return running_ ? Averages() : averages_;
  Averages all;
  record_->files().for_each_average(
      [&](const std::string& name, const Observable<D>& average) { all[name] = average.table(); });
  return all;
}

template <int D>
void Session<D>::set_bath_temperature(double temperature) {
  ValueTable* const table = values_.find("bath");
  if (table == nullptr) refuse("there is no bath; call add_bath() first");
  if (running_ && !(showing_ && std::this_thread::get_id() == runner_))
    refuse("a run is going on; change the temperature of the bath in its callback, before it or after it");
  if (!running_) need_state_at_end("the temperature of the bath");
  Parameters given = table->values;
  given.set("temperature", temperature);
  given.erase("ramp_time");
  *table = table_of("bath", std::move(given));
  box_.bath.set_temperature(temperature);
  (at_work_ ? at_work_->box : system_->box).bath.set_temperature(temperature);
}

template <int D>
void Session<D>::draw(std::span<const double> temperature, std::uint64_t seed, bool spins) {
  const Constants constants = views_.constants();
  const auto v = views_.velocity();
  const auto spin = views_.spin();
  Particles<D> p;
  p.mass.assign(constants.mass.begin(), constants.mass.end());
  p.radius.assign(constants.radius.begin(), constants.radius.end());
  p.species.assign(constants.species.begin(), constants.species.end());
  p.v.assign(v.begin(), v.end());
  p.spin.assign(spin.begin(), spin.end());
  p.x.resize(size_);
  p.spin.resize(size_, Spin<D>::Zero());
  const auto [chosen, each] = heated(temperature);
  if (spins) {
    draw_spins<D>(p, box_.contacts, chosen, each, seed);
    set_spin({p.spin.data()->data(), size_ * Spin<D>::SizeAtCompileTime});
  } else {
    draw_velocities<D>(p, chosen, each, seed);
    set_velocity({p.v.data()->data(), size_ * D});
  }
}

template class Session<2>;
template class Session<3>;

}  // namespace carom::python
