// SPDX-License-Identifier: BSD-3-Clause
// Short runs and single evaluations whose results have the same bits on every processor and by every compiler: the hashes
// here are checked by each build that runs this test. A change of results that is meant changes them.

#include <gtest/gtest.h>

#include <bit>
#include <map>

#include "engine/base/elementary.h"
#include "engine/base/random.h"
#include "engine/run/radial_distribution.h"
#include "engine/setup/compression.h"
#include "engine/slabs/path_hash.h"
#include "tests/support/experiments.h"
#include "tests/unit/potentials/cases.h"

namespace carom {
namespace {

struct Hash {
  std::uint64_t word = 0;
  void add(double value) { add_to_hash(word, std::bit_cast<std::uint64_t>(value)); }
  template <int D>
  void add(const std::vector<Vec<D>>& x) {
    for (const Vec<D>& each : x)
      for (const double value : each) add(value);
  }
};

/// Expects the hash that is stored under this name.
void expect(const std::string& name, const Hash& hash) {
  static const std::map<std::string, std::uint64_t> stored = {
  };
  const auto found = stored.find(name);
  EXPECT_TRUE(found != stored.end() && found->second == hash.word)
      << "      {\"" << name << "\", 0x" << std::hex << hash.word << "},";
}

/// A run's particles, energies and pressure.
template <int D>
void expect_run(const std::string& name, const Simulation<D>& run) {
  Hash hash;
  hash.add<D>(run.system().particles.x);
  hash.add<D>(run.system().particles.v);
  const Statistics& s = run.statistics();
  for (const double value : {s.end_time, s.energy_final, s.max_energy_error, s.mean_pressure}) hash.add(value);
  expect(name + (D == 2 ? ", 2-D" : ", 3-D"), hash);
}

TEST(Processors, DrawTheSameNumbers) {
  Hash normal, elementary;
  RandomStream random(3, RandomPurpose::probe, 0);
  for (int n = 0; n < 10000; ++n) {
    for (const double value : random.normal_pair()) normal.add(value);
    const double u = random.uniform(), x = 40 * u - 20;
    for (const double value : {elementary::exp(x), elementary::expm1(x), elementary::log(u), elementary::log1p(-u),
                               elementary::pow(u, x), elementary::erfc(x), elementary::cbrt(u)})
      elementary.add(value);
  }
  expect("normal deviates", normal);
  expect("elementary functions", elementary);
}

template <int D>
void expect_forces() {
  int number = 0;
  test::for_each_case<D>([&](test::Scene<D>& scene, const Interaction<D>& term) {
    const auto& x = scene.particles.x;
    Hash hash;
    hash.add(test::energy(term, x));
    hash.add<D>(test::forces(term, x));
    hash.add<D>(test::mean_forces(term, x, test::displaced(x, scene.random_vectors(0.1), 1)));
    expect("forces " + test::cases()[number].type + " " + std::to_string(number) + (D == 2 ? ", 2-D" : ", 3-D"), hash);
    ++number;
  });
}

TEST(Processors, EvaluateTheSameForces) {
  expect_forces<2>();
  expect_forces<3>();
}

template <int D>
void expect_flight() {
  const auto run = test::make_run<D>(test::hard_spheres<D>(D == 2 ? 6 : 3, 0.45), "free-flight", {.end_time = 4});
  RadialDistribution<D> measured(run->system(), {.sampling = {.interval = 0.1}, .range = 1.5, .bins = 40});
  run->add(measured);
  run->run();
  expect_run("free-flight", *run);
  Hash hash;
  for (const double g : measured.g()) hash.add(g);
  hash.add(measured.contact_value(0, 0).value_or(0));
  expect(D == 2 ? "g(r), 2-D" : "g(r), 3-D", hash);

  Box<D> box;
  box.edges = Vec<D>::Constant(5);
  const auto packed = compress<D>(box, std::vector<double>(D == 2 ? 18 : 80, 0.5), {.seed = 2});
  Hash places;
  places.add<D>(packed.x);
  expect(D == 2 ? "compression, 2-D" : "compression, 3-D", places);
}

TEST(Processors, FlyTheSameWay) {
  expect_flight<2>();
  expect_flight<3>();
}

TEST(Processors, StepTheSameWay) {
  for (const char* method : {"psa", "cva", "mcva", "cdda", "edda"}) {
    const auto name = [&](const char* system) { return std::string(method) + ", " + system; };
    expect_run(name("springs"), *test::run_steps(test::five_springs(), method, 0.01, 200));
    expect_run(name("gravity"), *test::run_steps(test::nine_gravity(), method, 0.01, 200));
    expect_run(name("bonds"), *test::run_steps(test::bonded_cluster(), method, 0.01, 100));
    expect_run(name("gravity"), *test::run_steps(test::gravity_cluster(), method, 0.01, 100));
  }
}

}  // namespace
}  // namespace carom
