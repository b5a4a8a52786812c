// SPDX-License-Identifier: BSD-3-Clause
#include "io/command/bench.h"

#include <malloc.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <fstream>
#include <string>

#include "engine/base/error.h"
#include "engine/integrators/integrator.h"
#include "engine/setup/epoch.h"
#include "engine/setup/placement.h"
#include "io/command/bench_forces.h"
#include "io/command/bench_state.h"
#include "io/command/bench_table.h"
#include "io/deck/deck_build.h"

namespace carom {
namespace {

using namespace bench;

/// A size in the table of /proc/self/status [bytes]; nothing where there is no such table.
std::optional<double> process_memory(const std::string& name) {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;)
    if (double kibibytes = 0; word == name + ":" && status >> kibibytes) return 1024 * kibibytes;
  return {};
}

/// The peak of resident memory above what was resident at its making [bytes]. Linux resets the earlier peak on request
/// (proc(5), clear_refs); where it does not, there is no answer.
class PeakMemory {
 public:
  PeakMemory() {
    forget();
    before_ = process_memory("VmRSS");
  }
  /// Counts the peak from now on.
  void forget() {
    malloc_trim(0);  // what has been freed
    std::ofstream clear("/proc/self/clear_refs");
    clear << "5" << std::flush;
    known_ = clear.good();
  }
  std::optional<double> growth() const {
    const auto peak = process_memory("VmHWM");
    if (!known_ || !peak || !before_) return {};
    return *peak - *before_;
  }

 private:
  bool known_ = false;
  std::optional<double> before_;
};

/// A stretch of a run.
struct Stretch {
  std::uint64_t collisions = 0;
  double seconds = 0, time = 0;
  double rate() const { return static_cast<double>(collisions) / seconds; }
};

/// Free flight in whole epochs.
template <int D>
class Flow {
 public:
  explicit Flow(std::unique_ptr<System<D>> system)
      : system_(std::move(system)),
        epoch_(default_epoch(*system_)),
        integrator_(make_integrator<D>("free-flight", {{"step", epoch_}})) {
    integrator_->start(*system_, counters_);
  }

  /// Runs this many epochs, and more until there have been this many pair collisions.
  Stretch run(std::uint64_t epochs, std::uint64_t collisions) {
    constexpr std::uint64_t kMostEpochs = 1000;  // epochs, each of forty mean free times
    const std::uint64_t before = counters_.sphere_sphere;
    const auto start = Clock::now();
    Stretch done;
    for (std::uint64_t k = 0; k < epochs || done.collisions < collisions; ++k) {
      if (k == kMostEpochs && done.collisions == 0)
        throw Error(Failure::numerical, "nothing collides; take more spheres or a higher packing fraction");
      SlabReport<D> report{.counters = counters_};
      integrator_->slab(*system_, {.index = slabs_, .start = static_cast<double>(slabs_) * epoch_, .length = epoch_},
                        report);
      ++slabs_;
      done.collisions = counters_.sphere_sphere - before;
      done.time += epoch_;
    }
    done.seconds = seconds_since(start);
    return done;
  }

  /// Gives the system away; nothing else may be called any more.
  std::unique_ptr<System<D>> release() { return std::move(system_); }
  const System<D>& system() const { return *system_; }
  const Counters& counters() const { return counters_; }
  double epoch() const { return epoch_; }

 private:
  std::unique_ptr<System<D>> system_;
  double epoch_;
  std::unique_ptr<Integrator<D>> integrator_;
  Counters counters_;
  std::int64_t slabs_ = 0;
};

double ratio(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? 0 : static_cast<double>(part) / static_cast<double>(whole);
}

/// pV/(N k T) of a stretch, from the virial: it distinguishes a fluid from a crystal that has not melted.
template <int D>
double compressibility(const System<D>& system, double virial, double time) {
  double twice_kinetic = 0;
  for (std::size_t i = 0; i < system.particles.size(); ++i)
    twice_kinetic += system.particles.mass[i] * system.particles.v[i].squaredNorm();
  return 1 + virial / (time * twice_kinetic);
}

/// Equilibrates and measures one state. The core that is measured has not seen the lattice melt, which is hard work.
template <int D>
Json measure(std::unique_ptr<System<D>> state, const BenchOptions& options, PeakMemory& memory) {
  const std::size_t n = state->particles.size();
  const double filled = packing_fraction<D>(state->box.volume(), state->particles.radius);
  Stretch melting;
  if (options.epochs_before() > 0) {
    Flow<D> flow(std::move(state));
    melting = flow.run(options.epochs_before(), 0);
    state = flow.release();
  }
  if (options.save_state) write_state(*options.save_state, *state);

  memory.forget();
  Flow<D> flow(std::move(state));
  flow.run(BenchOptions::kWarmUp, 0);
  const Counters before = flow.counters();
  std::vector<double> rates;
  Json repeats = Json::array();
  Stretch all;
  for (std::uint64_t r = 0; r < options.repeat; ++r) {
    const Stretch stretch = flow.run(1, options.collisions);
    rates.push_back(stretch.rate());
    repeats.push_back({{"collisions", stretch.collisions}, {"seconds", stretch.seconds}});
    all.collisions += stretch.collisions;
    all.time += stretch.time;
  }
  const auto bytes = memory.growth();

  const EventCounts &a = before.events, &b = flow.counters().events;
  const EventCounts count{b.predictions - a.predictions, b.candidates - a.candidates, b.stale - a.stale,
                          b.crossings - a.crossings,     b.rebuilds - a.rebuilds,     b.scheduled - a.scheduled,
                          b.dropped - a.dropped};
  const auto a_collision = [&](std::uint64_t number) { return ratio(number, all.collisions); };
  const double virial = flow.counters().collision_virial.value() - before.collision_virial.value();
  return {
      {"n", n},
      {"dimension", D},
      {"packing_fraction", filled},
      {"epoch", flow.epoch()},
      {"equilibration_epochs", options.epochs_before()},
      {"equilibration_collisions", melting.collisions},
      {"collisions", all.collisions},
      {"collisions_per_second", spread(rates)},
      {"repeats", repeats},
      {"bytes_per_particle", bytes ? Json(*bytes / static_cast<double>(n)) : Json(nullptr)},
      {"per_collision",
       {{"crossings", a_collision(count.crossings)},
        {"rebuilds", a_collision(count.rebuilds)},
        {"stale", a_collision(count.stale)},
        {"predictions", a_collision(count.predictions)},
        {"scheduled", a_collision(count.scheduled)}}},
      {"candidates_per_prediction", ratio(count.candidates, count.predictions)},
      {"stale_fraction", ratio(count.dropped, count.scheduled)},
      {"compressibility_factor", compressibility(flow.system(), virial, all.time)},
      {"max_overlap", flow.counters().max_overlap},
  };
}

template <int D>
Json lattice_point(std::uint64_t n, double filled, const BenchOptions& options) {
  PeakMemory memory;
  return measure(lattice_state<D>(n, filled, kSeed), options, memory);
}

template <int D>
Json file_point(const BenchOptions& options) {
  PeakMemory memory;
  return measure(read_state<D>(*options.state), options, memory);
}

std::string heading(const BenchOptions& options) {
  return title() +
         fmt::format(
             "Hard spheres in a periodic box, free-flight, one core. Equilibrated for {} epochs of about forty mean "
             "free times,\n"
             "then measured {} times over at least {} collisions (whole epochs). B/part.: peak resident memory above\n"
             "that before the state was made. Z = pV/NkT. Events, predictions and entries scheduled: a collision;\n"
             "cand.: pairs evaluated a prediction; dropped: entries of these that no longer held, a scheduled one.\n\n",
             options.epochs_before(), options.repeat, options.collisions) +
         fmt::format("{:>8} {:>6} {:>12} {:>21} {:>7} {:>7} {:>9} {:>8} {:>7} {:>7} {:>6} {:>7} {:>7}\n", "N", "phi",
                     "collisions/s", "min .. max", "B/part.", "Z", "crossings", "rebuilds", "stale", "predict", "cand.",
                     "sched.", "dropped");
}

std::string row(const Json& point) {
  const Json &rate = point["collisions_per_second"], &per = point["per_collision"],
             &bytes = point["bytes_per_particle"];
  const auto number = [](const Json& value) { return value.get<double>(); };
  return fmt::format(
      "{:>8} {:>6.3f} {:>12.0f} {:>21} {:>7} {:>7.3f} {:>9.3f} {:>8.4f} {:>7.3f} {:>7.3f} {:>6.1f} {:>7.3f} {:>7.3f}\n",
      point["n"].get<std::uint64_t>(), number(point["packing_fraction"]), number(rate["median"]), range(rate),
      bytes.is_null() ? "-" : fmt::format("{:.0f}", number(bytes)), number(point["compressibility_factor"]),
      number(per["crossings"]), number(per["rebuilds"]), number(per["stale"]), number(per["predictions"]),
      number(point["candidates_per_prediction"]), number(per["scheduled"]), number(point["stale_fraction"]));
}

}  // namespace

int bench_command(const BenchOptions& options) {
  if (options.forces) {
    bench_forces(options);
    return 0;
  }
  if (options.save_state && !options.state && options.sizes().size() * options.packing_fraction.size() != 1)
    throw Error(Failure::deck,
                "--save-state: error: there are several states; give one --n and one --packing-fraction");
  const int dimension = options.state ? state_dimension(*options.state) : options.dimension;
  Json points = Json::array();
  const auto add = [&](Json point) {
    say(row(point));
    points.push_back(std::move(point));
    store(options, {{"points", points}});
  };
  store(options, {{"points", points}});  // a file that cannot be written is better known before an hour of work
  say(heading(options));
  if (options.state) {
    add(dimension == 2 ? file_point<2>(options) : file_point<3>(options));
  } else {
    for (const std::uint64_t n : options.sizes())
      for (const double filled : options.packing_fraction)
        add(dimension == 2 ? lattice_point<2>(n, filled, options) : lattice_point<3>(n, filled, options));
  }
  return 0;
}

}  // namespace carom
