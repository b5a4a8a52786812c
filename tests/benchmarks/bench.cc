// SPDX-License-Identifier: BSD-3-Clause
#include "bench.h"

#include <spdlog/fmt/fmt.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <iostream>

#include "engine/base/error.h"
#include "io/files/text_file.h"
#include "io/files/version.h"

namespace carom::bench {

Deck deck_of(const std::string& text) {
  return read_deck("bench.toml", {}, [&](const std::filesystem::path&) { return std::optional(text); });
}

[[gnu::noinline]] double timed(const std::function<void()>& work) {
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  work();
  return std::chrono::duration<double>(Clock::now() - start).count();
}

void say(const std::string& text) {
  if (std::fputs(text.c_str(), stdout) < 0 || std::fflush(stdout) != 0)
    throw Error(Failure::file, "standard output: cannot write to it");
}

std::string title() { return "carom " + version_string() + "\n" + compiler_string() + "\n"; }

Json spread(std::vector<double> values) {
  std::ranges::sort(values);
  const std::size_t half = values.size() / 2;
  const double median = values.size() % 2 == 1 ? values[half] : (values[half - 1] + values[half]) / 2;
  return {{"median", median}, {"min", values.front()}, {"max", values.back()}};
}

std::string range(const Json& spread, double unit) {
  return fmt::format("{:.0f} .. {:.0f}", spread["min"].get<double>() / unit, spread["max"].get<double>() / unit);
}

void store(const Options& options, const Json& results) {
  if (options.json.empty()) return;
  Json all = {{"version", version_string()}, {"compiler", compiler_string()}};
  all.update(results);
  write_file_atomically(options.json, all.dump(2) + "\n");
}

namespace {

int bench_main(int argc, char** argv) {
  CLI::App app{"The speed of carom's event core on this machine, or of its forces"};
  Options options;
  const auto number = [&app](const char* name, std::uint64_t& value, const char* meaning, std::uint64_t least) {
    return app.add_option(name, value, meaning)
        ->capture_default_str()
        ->type_name("NUMBER")
        ->check(CLI::Range(least, std::uint64_t{1} << 50));
  };
  auto* forces = app.add_flag("--forces", options.forces, "Measure the loops over pairs instead of the event core");
  app.add_option("--n", options.n, "Numbers of particles; 1000 10000 100000 1000000, of --forces 32000")
      ->type_name("N")
      ->check(CLI::Range(std::uint64_t{10}, std::uint64_t{1000000000}));
  number("--repeat", options.repeat, "Measurements of each state", 1);
  app.add_option("--json", options.json, "Also write all results to this file")->type_name("FILE");

  auto* filled = app.add_option("--packing-fraction", options.packing_fraction, "Packing fractions");
  filled->capture_default_str()->type_name("PHI")->check(CLI::Range(1e-6, 0.91))->excludes(forces);
  auto* dimension = app.add_option("--dimension", options.dimension, "2 or 3");
  dimension->capture_default_str()->check(CLI::IsMember({2, 3}))->excludes(forces);
  number("--equilibrate", options.equilibrate, "Epochs of forty mean free times before measuring", 0)->excludes(forces);
  auto* collisions =
      number("--collisions", options.collisions, "Collisions of a measurement, at least; whole epochs are measured", 1);
  collisions->excludes(forces);
  app.add_flag("--curve", options.curve,
               "Measure whole runs of 10000 (--n) spheres from dilute to dense: equal ones, mixtures, uneven gases; "
               "100000 collisions")
      ->excludes(forces)
      ->excludes(dimension);

  app.add_option("--potential", options.potential, "Of --forces: these potentials; all")
      ->needs(forces)
      ->check(CLI::IsMember(bench_potentials()));
  app.add_option("--kind", options.kind, "Of --forces: forces or 'mean forces'; both")
      ->needs(forces)
      ->check(CLI::IsMember({"forces", "mean forces"}));
  number("--pairs", options.pairs, "Of --forces: pairs of a measurement, at least; whole passes are measured", 1)
      ->needs(forces);
  number("--steps", options.steps, "Of --forces: steps of a measurement of the melt; 0: none", 0)->needs(forces);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : static_cast<int>(Failure::deck);
  }
  if (options.curve) {
    if (filled->count() == 0)
      options.packing_fraction = {1e-4, 3e-4, 1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05,
                                  0.1,  0.2,  0.3,  0.35, 0.4,  0.49, 0.55, 0.6};
    if (collisions->count() == 0) options.collisions = 100000;
    bench_curve(options);
  } else {
    options.forces ? bench_forces(options) : bench_events(options);
  }
  return 0;
}

}  // namespace
}  // namespace carom::bench

int main(int argc, char** argv) {
  try {
    return carom::bench::bench_main(argc, argv);
  } catch (const carom::Error& e) {
    std::cerr << e.what() << '\n';
    return e.exit_code();
  }
}
