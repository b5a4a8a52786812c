// SPDX-License-Identifier: BSD-3-Clause
#include <malloc.h>
#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>

#include <algorithm>
#include <fstream>
#include <numbers>
#include <string>

#include "bench.h"
#include "engine/base/error.h"
#include "engine/integrators/integrator.h"
#include "engine/setup/epoch.h"
#include "engine/setup/placement.h"

namespace carom::bench {
namespace {

constexpr std::uint64_t kWarmUp = 2;  // epochs of the measured core before the measurement

/// A size in the table of /proc/self/status [bytes]; nothing if there is no such table.
std::optional<double> process_memory(const std::string& name) {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;)
    if (double kibibytes = 0; word == name + ":" && status >> kibibytes) return 1024 * kibibytes;
  return {};
}

/// The peak of resident memory above the resident memory at construction [bytes]. Linux resets the earlier peak on
/// request (proc(5), clear_refs); otherwise there is no result.
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

/// The measured part of a run.
struct Stretch {
  std::uint64_t collisions = 0;
  double time = 0;
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
    return done;
  }

  /// Returns the system; no other function may be called afterwards.
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

/// `n` spheres of diameter 1 and mass 1 at temperature 1 on a lattice in the periodic box of this packing fraction: the
/// simple cubic (2-D: square) lattice if it fits, because it is unstable and melts at once, otherwise the face-centred
/// (hexagonal) one, which takes hundreds of collisions per particle to melt near freezing. The box is a cube (square),
/// for hexagonal lattices only approximately. Throws Error(Failure::initial_state) if spheres overlap.
template <int D>
std::unique_ptr<System<D>> lattice_state(std::uint64_t n, double filled) {
  constexpr const char* text = R"(format = 1
system = {{ dimension = {}, box = {}, boundary = {} }}
particles = [{{ name = "sphere", count = {}, radius = 0.5, temperature = 1.0 }}]
placement = {{ type = "{}", seed = {} }}
integrator = {{ type = "free-flight" }}
run = {{ steps = 1 }}
)";
  const double sphere = D == 2 ? std::numbers::pi / 4 : std::numbers::pi / 6;
  for (const bool centred : {false, true}) {
    const Lattice lattice = centred ? Lattice::centred : Lattice::simple;
    const char* const name = centred ? (D == 2 ? "hexagonal" : "fcc") : (D == 2 ? "square" : "simple-cubic");
    const Vec<D> edges = commensurate_edges<D>(lattice, n, static_cast<double>(n) * sphere / filled);
    Deck deck = deck_of(fmt::format(text, D, std::vector<double>(edges.begin(), edges.end()),
                                    std::vector<std::string>(D, "periodic"), n, name, kSeed));
    try {
      return build_system<D>(deck);
    } catch (const Error& e) {
      if (e.failure() != Failure::initial_state) throw;
    }
  }
  throw Error(
      Failure::initial_state,
      fmt::format("{} spheres at packing fraction {} overlap on any lattice; lower the packing fraction", n, filled));
}

/// Equilibrates and measures one state. The measured core did not run during the melting, which is more work.
template <int D>
Json measure(std::uint64_t n, double filled, const Options& options) {
  PeakMemory memory;
  auto state = lattice_state<D>(n, filled);
  filled = packing_fraction<D>(state->box.volume(), state->particles.radius);
  Stretch melting;
  if (options.equilibrate > 0) {
    Flow<D> flow(std::move(state));
    melting = flow.run(options.equilibrate, 0);
    state = flow.release();
  }

  memory.forget();
  Flow<D> flow(std::move(state));
  flow.run(kWarmUp, 0);
  const Counters before = flow.counters();
  std::vector<double> rates;
  Json repeats = Json::array();
  Stretch all;
  for (std::uint64_t r = 0; r < options.repeat; ++r) {
    Stretch stretch;
    const double seconds = timed([&] { stretch = flow.run(1, options.collisions); });
    rates.push_back(static_cast<double>(stretch.collisions) / seconds);
    repeats.push_back({{"collisions", stretch.collisions}, {"seconds", seconds}});
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
      {"equilibration_epochs", options.equilibrate},
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

std::string heading(const Options& options) {
  return title() +
         fmt::format(
             "Hard spheres in a periodic box, free-flight, one core. Equilibrated for {} epochs of about forty mean "
             "free times,\n"
             "then measured {} times over at least {} collisions (whole epochs). B/part.: peak resident memory above\n"
             "that before the state was made. Z = pV/NkT. Events, predictions and entries scheduled: a collision;\n"
             "cand.: pairs evaluated a prediction; dropped: entries of these that no longer held, a scheduled one.\n\n",
             options.equilibrate, options.repeat, options.collisions) +
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

void bench_events(const Options& options) {
  Json points = Json::array();
  store(options, {{"points", points}});  // finds a file that cannot be written before an hour of work
  say(heading(options));
  for (const std::uint64_t n : options.sizes())
    for (const double filled : options.packing_fraction) {
      points.push_back(options.dimension == 2 ? measure<2>(n, filled, options) : measure<3>(n, filled, options));
      say(row(points.back()));
      store(options, {{"points", points}});
    }
}

}  // namespace carom::bench
