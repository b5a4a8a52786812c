// SPDX-License-Identifier: BSD-3-Clause
// Short runs and single evaluations whose results have equal bits on every processor and with every compiler: each
// build that runs this test checks these hashes. An intended change of results changes them.

#include <gtest/gtest.h>

#include <bit>
#include <map>

#include "engine/base/elementary.h"
#include "engine/base/random.h"
#include "engine/run/radial_distribution.h"
#include "engine/setup/compression.h"
#include "engine/stepping/path_hash.h"
#include "tests/support/experiments.h"
#include "tests/unit/potentials/cases.h"

namespace carom::processors_test {
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

/// Expects the stored hash of this name.
void expect(const std::string& name, const Hash& hash) {
  static const std::map<std::string, std::uint64_t> stored = {
      {"normal deviates", 0x7086691b30edab8},
      {"elementary functions", 0xeff95f9765dceb93},
      {"forces harmonic-bond 0, 2-D", 0x26b9e5853a370c24},
      {"forces harmonic-bond 1, 2-D", 0xc35f15715434be8a},
      {"forces gravity 2, 2-D", 0x9787d0e947197bae},
      {"forces gravity 3, 2-D", 0x38797d562d9666ac},
      {"forces coulomb 4, 2-D", 0xb55d2ad985e89ca1},
      {"forces coulomb 5, 2-D", 0x87adc280bf05fe49},
      {"forces yukawa 6, 2-D", 0x1aae9beb00ada616},
      {"forces yukawa 7, 2-D", 0x504b5be1c3ed1147},
      {"forces lennard-jones 8, 2-D", 0x2e46db155cb6b870},
      {"forces lennard-jones 9, 2-D", 0xa628119947fd836a},
      {"forces lennard-jones 10, 2-D", 0x49aa400ca72eb53c},
      {"forces table 11, 2-D", 0x58a0e363723b4c38},
      {"forces wca 12, 2-D", 0x82872b2dd54386cf},
      {"forces morse 13, 2-D", 0xa17393545e86dc11},
      {"forces morse 14, 2-D", 0x2ae3150657636f94},
      {"forces inverse-power 15, 2-D", 0x162322d7ac655f78},
      {"forces uniform-field 16, 2-D", 0x5665a866c6499b7},
      {"forces harmonic-trap 17, 2-D", 0x235c0a5b5de71e37},
      {"forces uniform-field 18, 2-D", 0x4c55dab6d661f3d9},
      {"forces harmonic-bond 0, 3-D", 0x3185f99dd98731f7},
      {"forces harmonic-bond 1, 3-D", 0xf715f710285ccd18},
      {"forces gravity 2, 3-D", 0x5195dc0b0fde2135},
      {"forces gravity 3, 3-D", 0x34780d2bb0f46337},
      {"forces coulomb 4, 3-D", 0x267222ae2f567e6a},
      {"forces coulomb 5, 3-D", 0x8c5ffe881152f8f0},
      {"forces yukawa 6, 3-D", 0xb8e5d47dd07dca10},
      {"forces yukawa 7, 3-D", 0x89c4d8c6037a23bc},
      {"forces lennard-jones 8, 3-D", 0xc5d777ab44626491},
      {"forces lennard-jones 9, 3-D", 0xf1202daece654dd7},
      {"forces lennard-jones 10, 3-D", 0x5fd7ebf4b3705688},
      {"forces table 11, 3-D", 0x4438b57cf1b8f31c},
      {"forces wca 12, 3-D", 0x7aad4046c860f91},
      {"forces morse 13, 3-D", 0x71b1e17d777d3bd1},
      {"forces morse 14, 3-D", 0x5bb278b38876cf2d},
      {"forces inverse-power 15, 3-D", 0x1a8549af861c1dc7},
      {"forces uniform-field 16, 3-D", 0xbc8a7f3b04a71023},
      {"forces harmonic-trap 17, 3-D", 0x40fc7847816452a2},
      {"forces uniform-field 18, 3-D", 0xcd3d438747239a3b},
      {"forces coulomb 19, 3-D", 0xdc4dd37f2f83c6a2},
      {"forces coulomb 20, 3-D", 0x6fc85bdd44ce68ee},
      {"free-flight, 2-D", 0xb16187a39856c8f0},
      {"g(r), 2-D", 0x856ff1085199a98c},
      {"compression, 2-D", 0xcbb049e9a124503},
      {"free-flight, 3-D", 0x41091bb1a479ae16},
      {"g(r), 3-D", 0xd459e6653f2eb95a},
      {"compression, 3-D", 0x1ccdd0e22553a2b3},
      {"psa, springs, 2-D", 0xfe0087fc81ac792d},
      {"psa, gravity, 2-D", 0x38e95f65ae750ac6},
      {"psa, bonds, 3-D", 0x2a21b1125a052136},
      {"psa, gravity, 3-D", 0x3b151e6b0f6cfa6f},
      {"cva, springs, 2-D", 0x715c4e86cd70a2},
      {"cva, gravity, 2-D", 0xba032469c1ef1fb8},
      {"cva, bonds, 3-D", 0xc0a32bcfaaf7e7b6},
      {"cva, gravity, 3-D", 0x5e4d2fd6523f0171},
      {"mcva, springs, 2-D", 0xae7a81030da8dd95},
      {"mcva, gravity, 2-D", 0x706c3f1b2b09cde0},
      {"mcva, bonds, 3-D", 0x4bb282bf20dd08ba},
      {"mcva, gravity, 3-D", 0xe710e602d8d780c4},
      {"cdda, springs, 2-D", 0x834ef126714b7fd9},
      {"cdda, gravity, 2-D", 0x5093aaf50e680acf},
      {"cdda, bonds, 3-D", 0x69d85efb37bcd350},
      {"cdda, gravity, 3-D", 0x7b18ec1a31b9ff9c},
      {"edda, springs, 2-D", 0x16835d780058e640},
      {"edda, gravity, 2-D", 0x5af6f16205f8aabd},
      {"edda, bonds, 3-D", 0x80b5c6ecd8f6cb6f},
      {"edda, gravity, 3-D", 0x6d1ca19c04d1c25d},
      {"free-flight, laws, ledger", 0x76200ac856674593},
      {"free-flight, laws, 2-D", 0x7a14df554b5bb08f},
      {"psa, laws, ledger", 0xf78ef86aac679420},
      {"psa, laws, 2-D", 0x60e71070a494a4b0},
      {"cva, laws, ledger", 0xf7480ab520ae9260},
      {"cva, laws, 2-D", 0x5464baa4b5afc5db},
      {"mcva, laws, ledger", 0xf7480ab520ae9260},
      {"mcva, laws, 2-D", 0x5464baa4b5afc5db},
      {"cdda, laws, ledger", 0x19d08d150ecbcd05},
      {"cdda, laws, 2-D", 0xe12bbb3447746851},
      {"edda, laws, ledger", 0x6608377546e5c369},
      {"edda, laws, 2-D", 0x398b993a29dab79},
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
  const auto run =
      test::make_run<D>(test::hard_spheres<D>(D == 2 ? 6 : 3, 0.45), "free-flight", {.step = 1, .end_time = 4});
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
    expect_run(name("springs"), *test::run_steps(test::five_springs(), method, 0.01, 1000));
    expect_run(name("gravity"), *test::run_steps(test::nine_gravity(), method, 0.01, 600));
    expect_run(name("bonds"), *test::run_steps(test::bonded_cluster(), method, 0.01, 400));
    expect_run(name("gravity"), *test::run_steps(test::gravity_cluster(), method, 0.01, 800));
  }
}

/// Rough and inelastic contacts, those of discs as of ice, a piston, a thermal and a shaken wall, and a bath.
std::unique_ptr<System<2>> driven(std::unique_ptr<System<2>> system) {
  Box<2>& box = system->box;
  box.add({.name = "x+", .velocity = 0.05});
  box.add({.name = "y-", .temperature = 1});
  box.add({.name = "y+", .amplitude = 0.1, .frequency = 0.5});
  box.bath = {.type = Bath::Type::andersen, .temperature = 1, .last_temperature = 2, .rate = 0.1};
  const TableValue ice{{"form", std::string("power")}, {"v0", 0.5}, {"exponent", 0.25}};
  test::set_law(*system, {{"restitution", 0.9}, {"tangential", 0.5}, {"friction", 0.3}});
  test::set_law(*system,
                {{"between", std::vector<std::string>(2, "sphere")}, {"restitution", ice}, {"tangential", -0.2}});
  return system;
}

void expect_driven(const std::string& name, const Simulation<2>& run) {
  Hash hash;
  for (const Spin<2>& spin : run.system().particles.spin) hash.add(spin[0]);
  const Counters& c = run.statistics().counters;
  for (const double value : {c.dissipated.value(), c.work.value(), c.heat.value()}) {
    EXPECT_NE(value, 0) << name;
    hash.add(value);
  }
  expect(name + ", ledger", hash);
  expect_run(name, run);
}

TEST(Processors, LoseAndGainTheSameEnergy) {
  auto free = test::nine_gravity();
  free->interactions.clear();
  expect_driven("free-flight, laws", *test::run_until<2>(driven(std::move(free)), "free-flight", 1, 20));
  for (const std::string method : {"psa", "cva", "mcva", "cdda", "edda"})
    expect_driven(method + ", laws", *test::run_until<2>(driven(test::five_springs()), method, 0.01, 20));
}

}  // namespace
}  // namespace carom::processors_test
