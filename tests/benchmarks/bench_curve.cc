// SPDX-License-Identifier: BSD-3-Clause
#include <spdlog/fmt/fmt.h>

#include <array>
#include <ctime>
#include <string>

#include "bench.h"
#include "engine/run/simulation.h"

namespace carom::bench {
namespace {

/// A gas of N spheres, of which `few` (a share of N, or a number if it is more than 1) are of another kind.
struct Gas {
  const char* name;
  double few;
  double radius, mass, temperature;  ///< of the few; of the others 0.5, 1 and 1
};

constexpr std::array<Gas, 6> kGases = {{{"equal", 0, 0.5, 1, 1},
                                        {"sizes 1:10", 1.0 / 1001, 5, 1000, 1},  // half of the volume
                                        {"1:10, 1 %", 0.01, 5, 1000, 1},
                                        {"masses 1:1e6", 0.5, 0.5, 1e6, 1},
                                        {"two of 1e10", 2, 0.5, 1e10, 1e10},
                                        {"one hot", 1.5, 0.5, 1, 1e6}}};

std::string deck_text(const Gas& gas, std::uint64_t n, double filled) {
  const auto few = static_cast<std::uint64_t>(gas.few <= 1 ? gas.few * static_cast<double>(n) + 0.5 : gas.few);
  const char* const placement = gas.radius == 0.5 ? "fcc" : filled > 0.3 ? "compressed" : "random";
  std::string text = fmt::format(R"(format = 1
system = {{ dimension = 3, boundary = ["periodic", "periodic", "periodic"] }}
placement = {{ type = "{}", packing_fraction = {}, seed = {} }}
integrator = {{ type = "free-flight" }}
run = {{ collisions = 1 }}
[[particles]]
name = "many"
count = {}
radius = 0.5
temperature = 1.0
)",
                                 placement, filled, kSeed, n - few);
  if (few > 0)
    text += fmt::format("[[particles]]\nname = \"few\"\ncount = {}\nradius = {}\nmass = {:.1f}\ntemperature = {:.1f}\n",
                        few, gas.radius, gas.mass, gas.temperature);
  return text;
}

/// Collisions per second of processor time.
double rate_of(const Gas& gas, std::uint64_t n, double filled, std::uint64_t collisions) {
  constexpr std::uint64_t kBefore = 2;  // collisions for each sphere before the measurement
  Deck deck = deck_of(deck_text(gas, n, filled));
  auto system = build_system<3>(deck);
  const IntegratorInfo& info = find_integrator(deck.integrator);
  deck.plan.collisions = kBefore * n;
  Simulation<3> run(std::move(system), info, info.make<3>(deck.integrator_parameters), deck.plan);
  run.run();
  deck.plan.collisions = kBefore * n + collisions;
  run.extend(deck.plan);
  const std::clock_t start = std::clock();
  timed([&] { run.run(); });
  return static_cast<double>(collisions) * CLOCKS_PER_SEC / static_cast<double>(std::clock() - start);
}

}  // namespace

void bench_curve(const Options& options) {
  Json points = Json::array();
  store(options, {{"points", points}});
  const std::uint64_t n = options.n.empty() ? 10000 : options.n.front();
  std::string heading =
      title() +
      fmt::format(
          "{} hard spheres in a periodic box, free-flight, one core: thousand collisions per second "
          "of processor time,\nin a run with its checks, over {} collisions after four of each sphere.\n\n{:>8}",
          n, options.collisions, "phi");
  for (const Gas& gas : kGases) heading += fmt::format(" {:>13}", gas.name);
  say(heading + "\n");
  for (const double filled : options.packing_fraction) {
    Json point = {{"n", n}, {"packing_fraction", filled}};
    say(fmt::format("{:>8}", filled));
    for (const Gas& gas : kGases) {
      const double rate = rate_of(gas, n, filled, options.collisions);
      point[gas.name] = rate;
      say(fmt::format(" {:>13.1f}", rate / 1000));
    }
    say("\n");
    points.push_back(point);
    store(options, {{"points", points}});
  }
}

}  // namespace carom::bench
