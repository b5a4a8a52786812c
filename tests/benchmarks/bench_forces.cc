// SPDX-License-Identifier: BSD-3-Clause
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <functional>

#include "bench.h"
#include "engine/base/random.h"
#include "engine/forces/forces.h"
#include "engine/forces/simd/pair_kernels.h"
#include "engine/run/simulation.h"
#include "engine/stepping/path_hash.h"

namespace carom::bench {
namespace {

constexpr double kDensity = 0.8442;
constexpr double kDisplacement = 0.15;      // largest displacement of particles from lattice sites along each axis
constexpr double kStepDisplacement = 0.01;  // from there to the ends of mean forces
constexpr std::uint64_t kMelting = 100;     // steps before the measurement

struct Case {
  std::string_view name;
  std::string_view interaction;  ///< as in a deck
};
constexpr Case kCases[] = {
    {"lennard-jones", "epsilon = 1.0\nsigma = 1.0\ncutoff = 2.5\ncut = \"shifted\""},
    {"wca", "epsilon = 1.0\nsigma = 1.0"},
    {"yukawa", "amplitude = 1.0\nkappa = 1.8\ncutoff = 2.5\ncut = \"shifted\""},
    {"inverse-power", "epsilon = 1.0\nsigma = 1.0\nexponent = 12.0\ncutoff = 2.5\ncut = \"shifted\""},
    {"coulomb", "form = \"damped-shifted\"\ndamping = 1.0\ncutoff = 2.5"},
};

/// An fcc lattice at temperature 1.44; random charges +1 and −1, which only `coulomb` uses.
Deck deck_of(const Case& each, std::uint64_t n, std::uint64_t steps) {
  constexpr const char* text = R"(format = 1
[system]
dimension = 3
box = [{0}, {0}, {0}]
boundary = ["periodic", "periodic", "periodic"]
[[particles]]
name = "plus"
count = {1}
charge = 1.0
temperature = 1.44
display_radius = 0.1
mass = 1.0
[[particles]]
name = "minus"
count = {2}
charge = -1.0
temperature = 1.44
display_radius = 0.1
mass = 1.0
[placement]
type = "fcc"
seed = {3}
[[interaction]]
type = "{4}"
{5}
[integrator]
type = "verlet"
step = 0.004
[run]
steps = {6}
[output]
directory = "unused"
)";
  const double edge = std::cbrt(static_cast<double>(n) / kDensity);
  return bench::deck_of(fmt::format(text, edge, n / 2, n - n / 2, kSeed, each.name, each.interaction, steps));
}

/// Each coordinate changed at random by up to `most`.
std::vector<Vec<3>> displaced(std::vector<Vec<3>> x, double most, std::uint64_t seed) {
  for (Id i = 0; i < x.size(); ++i) {
    RandomStream random(seed, RandomPurpose::position, i);
    for (double& coordinate : x[i]) coordinate += most * (2 * random.uniform() - 1);
  }
  return x;
}

std::string checksum(const std::vector<Vec<3>>& vectors) {
  std::uint64_t hash = 0;
  for (const auto& vector : vectors)
    for (const double component : vector) add_to_hash(hash, std::bit_cast<std::uint64_t>(component));
  return fmt::format("{:016x}", hash);
}

/// One potential: passes over its pairs, in each vector width.
void measure_pairs(const Case& each, std::uint64_t n, const Options& options, const std::function<void(Json)>& add) {
  Deck deck = deck_of(each, n, 1);
  const auto system = build_system<3>(deck);
  auto& x = system->particles.x;
  x = displaced(std::move(x), kDisplacement, kSeed);
  system->wrap();
  const auto x_new = displaced(x, kStepDisplacement, kSeed + 1);
  system->quanta = quanta(*system);
  std::vector<Vec<3>> forces(n);
  Counters counters;
  MeanForces<3> mean_forces;
  for (const bool mean : {false, true}) {
    const char* const kind = mean ? "mean forces" : "forces";
    if (!options.kind.empty() && options.kind != kind) continue;
    for (const PairKernels* kernels : available_kernels<PairKernels>()) {
      system->interactions[0]->use(*kernels);
      const auto pass = [&] {
        if (mean)
          mean_forces.evaluate(*system, x, x_new);
        else
          evaluate_forces<3>(*system, x, forces, counters);
      };
      pass();
      const std::uint64_t pairs =
          mean ? mean_forces.evaluate(*system, x, x_new) : system->interactions[0]->interacting_pairs(x);
      const std::uint64_t passes =
          std::max<std::uint64_t>(1, (options.pairs + pairs - 1) / std::max<std::uint64_t>(1, pairs));
      std::vector<double> rates;
      Json repeats = Json::array();
      for (std::uint64_t r = 0; r < options.repeat; ++r) {
        const double seconds = timed([&] {
          for (std::uint64_t k = 0; k < passes; ++k) pass();
        });
        rates.push_back(static_cast<double>(passes * pairs) / seconds);
        repeats.push_back({{"passes", passes}, {"seconds", seconds}});
      }
      if (mean)
        for (Id i = 0; i < n; ++i) forces[i] = mean_forces[i];
      add({{"potential", each.name},
           {"n", n},
           {"density", kDensity},
           {"kind", kind},
           {"width", kernels->name},
           {"pairs", pairs},
           {"pairs_per_second", spread(rates)},
           {"repeats", repeats},
           {"energy", evaluate_energy<3>(*system, mean ? x_new : x).energy.value()},
           {"checksum", checksum(forces)}});
    }
  }
}

/// Stores the time whenever a measurement begins or ends.
class StepClock final : public Observer<3> {
 public:
  explicit StepClock(std::uint64_t steps) : steps_(steps) {}
  void progress(const Statistics& s) override {
    const auto done = static_cast<std::uint64_t>(s.steps);
    if (done >= kMelting && (done - kMelting) % steps_ == 0) times_.push_back(Clock::now());
  }
  std::vector<double> seconds() const {
    std::vector<double> all;
    for (std::size_t k = 1; k < times_.size(); ++k)
      all.push_back(std::chrono::duration<double>(times_[k] - times_[k - 1]).count());
    return all;
  }

 private:
  using Clock = std::chrono::steady_clock;
  std::uint64_t steps_;
  std::vector<Clock::time_point> times_;
};

/// A Lennard-Jones crystal that melts.
Json measure_steps(std::uint64_t n, const PairKernels& kernels, const Options& options) {
  Deck deck = deck_of(kCases[0], n, kMelting + options.repeat * options.steps);
  auto system = build_system<3>(deck);
  system->interactions[0]->use(kernels);
  const IntegratorInfo& verlet = find_integrator(deck.integrator);
  Simulation<3> run(std::move(system), verlet, verlet.make<3>(deck.integrator_parameters), deck.plan);
  StepClock clock(options.steps);
  run.add(clock);
  run.run();
  std::vector<double> rates;
  Json repeats = Json::array();
  for (const double seconds : clock.seconds()) {
    rates.push_back(static_cast<double>(options.steps) / seconds);
    repeats.push_back({{"steps", options.steps}, {"seconds", seconds}});
  }
  return {{"potential", kCases[0].name},
          {"n", n},
          {"density", kDensity},
          {"integrator", deck.integrator},
          {"step", deck.plan.step},
          {"width", kernels.name},
          {"steps_per_second", spread(rates)},
          {"repeats", repeats},
          {"energy", run.statistics().energy_final},
          {"checksum", checksum(run.system().particles.x)}};
}

std::string pairs_heading(const Options& options) {
  return fmt::format(
             "Forces of pairs within the cutoff 2.5 (wca: 1.12), one core, a periodic box at density {}. Positions: "
             "an\n"
             "fcc lattice with each coordinate displaced at random by up to {}; ends of mean forces: by up to {} from\n"
             "there. Measured {} times over at least {} pairs (whole passes).\n\n",
             kDensity, kDisplacement, kStepDisplacement, options.repeat, options.pairs) +
         fmt::format("{:>8} {:<14} {:<11} {:<6} {:>14} {:>15} {:>15}\n", "N", "potential", "", "width",
                     "pairs/particle", "million pairs/s", "min .. max");
}

std::string pairs_row(const Json& entry) {
  const Json& rate = entry["pairs_per_second"];
  return fmt::format("{:>8} {:<14} {:<11} {:<6} {:>14.1f} {:>15.1f} {:>15}\n", entry["n"].get<std::uint64_t>(),
                     entry["potential"].get<std::string>(), entry["kind"].get<std::string>(),
                     entry["width"].get<std::string>(), entry["pairs"].get<double>() / entry["n"].get<double>(),
                     rate["median"].get<double>() / 1e6, range(rate, 1e6));
}

std::string steps_heading(const Options& options) {
  return fmt::format(
             "\nA Lennard-Jones melt: verlet with step 0.004 from an fcc lattice at temperature 1.44, density {}, cut "
             "and\nshifted at 2.5, energies at each step. After {} steps measured {} times over {}.\n\n",
             kDensity, kMelting, options.repeat, options.steps) +
         fmt::format("{:>8} {:<6} {:>9} {:>15}\n", "N", "width", "steps/s", "min .. max");
}

std::string steps_row(const Json& entry) {
  const Json& rate = entry["steps_per_second"];
  return fmt::format("{:>8} {:<6} {:>9.1f} {:>15}\n", entry["n"].get<std::uint64_t>(),
                     entry["width"].get<std::string>(), rate["median"].get<double>(), range(rate));
}

}  // namespace

std::vector<std::string> bench_potentials() {
  std::vector<std::string> names;
  for (const Case& each : kCases) names.emplace_back(each.name);
  return names;
}

void bench_forces(const Options& options) {
  vector_widths();  // throws if CAROM_SIMD asks for a width that is not available
  Json results = {{"forces", Json::array()}, {"steps", Json::array()}};
  const auto add = [&](const char* table, Json entry, auto&& row) {
    say(row(entry));
    results[table].push_back(std::move(entry));
    store(options, results);
  };
  store(options, results);
  say(title() + pairs_heading(options));
  for (const std::uint64_t n : options.sizes())
    for (const Case& each : kCases)
      if (options.potential.empty() || std::ranges::count(options.potential, each.name) > 0)
        measure_pairs(each, n, options, [&](Json entry) { add("forces", std::move(entry), pairs_row); });
  if (options.steps == 0) return;
  say(steps_heading(options));
  for (const std::uint64_t n : options.sizes())
    for (const PairKernels* kernels : available_kernels<PairKernels>())
      add("steps", measure_steps(n, *kernels, options), steps_row);
}

}  // namespace carom::bench
