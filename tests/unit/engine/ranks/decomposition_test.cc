// SPDX-License-Identifier: BSD-3-Clause
// Methods on several ranks against one rank: every bit is equal.

#include "engine/ranks/decomposition.h"

#include <gtest/gtest.h>

#include <numeric>

#include "engine/forces/forces.h"
#include "engine/ranks/id_blocks.h"
#include "engine/run/simulation.h"
#include "tests/support/experiments.h"
#include "tests/support/same_statistics.h"
#include "tests/support/thread_ranks.h"

namespace carom::decomposition_test {
namespace {

using test::Given;

/// Everything that a run reports.
template <int D>
struct Account : Observer<D> {
  explicit Account(Communicator* shared_by = nullptr) : ranks(shared_by), rank(ranks ? ranks->rank() : 0) {}
  void frame(const Snapshot<D>& shot) override {
    frames.push_back(ranks ? gathered(*ranks, *shot.particles) : *shot.particles);
    note(shot);
  }
  void thermo(const Snapshot<D>& shot) override { note(shot); }
  void contacts(double start, std::span<const Contact<D>> all) override {
    for (const auto& contact : all) {
      events.push_back(contact.key);
      values.push_back(start);
      for (int k = 0; k < D; ++k) values.insert(values.end(), {contact.x_lo[k], contact.x_hi[k], contact.impulse[k]});
    }
  }
  void note(const Snapshot<D>& s) {
    values.insert(values.end(), {s.time, s.kinetic, s.potential, std::isnan(s.shadow) ? 0 : s.shadow, s.pressure});
    for (int k = 0; k < D; ++k) values.push_back(s.momentum[k]);
  }
  Communicator* ranks;
  int rank;
  std::vector<Particles<D>> frames;  // on rank 0 only
  std::vector<EventKey<D>> events;
  std::vector<double> values;
  Statistics statistics;
};

template <int D>
using Scene = std::function<std::unique_ptr<System<D>>()>;

template <int D>
Account<D> run(const Scene<D>& scene, const std::string& method, const Plan& plan, const Given& given,
               Communicator* ranks) {
  auto system = scene();
  if (ranks) system->decomposition.join(*ranks);
  auto simulation = test::make_run<D>(std::move(system), method, plan, given);
  Account<D> account(ranks);
  simulation->add(account);
  simulation->run();
  account.statistics = simulation->statistics();
  return account;
}

template <int D>
void expect_same(const Account<D>& one, const Account<D>& other) {
  ASSERT_EQ(one.frames.size(), other.frames.size());
  for (std::size_t k = 0; k < one.frames.size(); ++k) {
    if (other.rank > 0) continue;  // this rank has no output
    EXPECT_EQ(one.frames[k].x, other.frames[k].x) << "frame " << k;
    EXPECT_EQ(one.frames[k].v, other.frames[k].v) << "frame " << k;
    EXPECT_EQ(one.frames[k].image, other.frames[k].image) << "frame " << k;
    EXPECT_EQ(one.frames[k].spin, other.frames[k].spin) << "frame " << k;
  }
  EXPECT_EQ(one.events, other.events);
  EXPECT_EQ(one.values, other.values);
  test::expect_same(one.statistics, other.statistics);
}

/// `contacts`: the smallest number of collisions that makes the test meaningful.
template <int D>
Statistics compare(const Scene<D>& scene, const std::string& method, double step, std::int64_t steps,
                   std::uint64_t contacts, const Given& given = {}) {
  SCOPED_TRACE(method);
  const Plan plan{
      .step = step, .steps = steps, .frame_interval = 7 * step, .thermo_interval = 3 * step, .events = true};
  const Account<D> alone = run<D>(scene, method, plan, given, nullptr);
  EXPECT_GE(alone.statistics.counters.sphere_sphere + alone.statistics.counters.sphere_wall, contacts);
  Statistics last;  // for the largest number of ranks
  for (const int ranks : {1, 2, 3, 4, 8}) {
    SCOPED_TRACE(ranks);
    std::vector<Account<D>> all(static_cast<std::size_t>(ranks));
    test::ThreadRanks(ranks).run([&](Communicator& exchange) {
      all[static_cast<std::size_t>(exchange.rank())] = run<D>(scene, method, plan, given, &exchange);
    });
    for (const Account<D>& account : all) expect_same(alone, account);
    last = all.front().statistics;
    if (::testing::Test::HasFailure()) break;
  }
  return last;
}

/// A fluid of spheres that repel each other at a distance.
Scene<3> yukawa(double packing_fraction) {
  return [=] {
    auto system = test::hard_spheres<3>(3, packing_fraction);
    test::add_interaction(
        *system, "yukawa",
        {{"amplitude", 2.0}, {"kappa", 2.0}, {"charges", false}, {"cutoff", 1.8}, {"cut", std::string("switch")}});
    return system;
  };
}

/// Discs on a lattice, each joined to its neighbours by springs, also across the edges of the box.
std::unique_ptr<System<2>> springs(int cells) {
  auto system = test::hard_spheres<2>(cells, 0.5);
  test::add_interaction(*system, "harmonic-bond", {{"within", 1.4}, {"stiffness", 3.0}, {"rest_length", 1.2}});
  return system;
}

/// Spheres of several sizes and masses that attract each other between walls.
std::unique_ptr<System<3>> cloud() {
  std::vector<Vec<3>> x, v;
  std::vector<double> radius, mass;
  for (int k = 0; k < 60; ++k) {
    x.push_back({1.0 + 1.7 * (k % 4), 1.0 + 1.7 * (k / 4 % 4), 1.0 + 1.7 * (k / 16)});
    v.push_back({0.8 * (k % 7 - 3), 0.8 * (k % 5 - 2), 0.8 * (k % 3 - 1)});
    radius.push_back(0.4 + 0.1 * (k % 3));
    mass.push_back(1.0 + 0.5 * (k % 4));
  }
  auto system = test::make_system<3>({8, 8, 8}, Boundary::wall, x, v, radius, mass);
  test::add_interaction(*system, "gravity", {{"constant", 0.05}});
  test::add_interaction(*system, "harmonic-trap", {{"stiffness", 0.3}});
  return system;
}

/// A rod of spheres of several sizes, falling, between walls at its ends.
std::unique_ptr<System<3>> rod() {
  std::vector<Vec<3>> x, v;
  std::vector<double> radius, mass;
  for (int k = 0; k < 1024; ++k) {
    x.push_back({0.7 + 1.25 * (k / 16), 0.6 + 1.25 * (k / 4 % 4), 0.6 + 1.25 * (k % 4)});
    v.push_back({0.3 * (k % 7 - 3), 0.4 * (k % 5 - 2), 0.5 * (k % 3 - 1)});
    radius.push_back(0.5 + 0.05 * (k % 3));
    mass.push_back(1.0 + 0.5 * (k % 4));
  }
  auto system = test::make_system<3>({80.5, 5, 5}, Boundary::periodic, x, v, radius, mass);
  system->box.boundary[0] = Boundary::wall;
  test::add_interaction(
      *system, "yukawa",
      {{"amplitude", 2.0}, {"kappa", 2.0}, {"charges", false}, {"cutoff", 1.8}, {"cut", std::string("switch")}});
  test::add_interaction(*system, "uniform-field", {{"acceleration", std::vector<double>{-1.0, 0.0, 0.0}}});
  return system;
}

const std::vector<std::pair<std::string, Given>> kMethods = {
    {"psa", {}},  {"cva", {}},
    {"mcva", {}}, {"mcva", {{"variant", std::string("restart")}}},
    {"cdda", {}}, {"cdda", {{"order", std::int64_t{4}}}},
    {"edda", {}}, {"edda", {{"tolerance", 0.0}}}};

TEST(Decomposition, Springs) {
  for (const auto& [method, given] : kMethods) compare<2>([] { return springs(7); }, method, 0.02, 25, 20, given);
}
/// Spheres joined to their neighbours that attract all other spheres; with a long-range correction, and a table.
std::unique_ptr<System<3>> chains() {
  auto system = test::hard_spheres<3>(3, 0.45);
  test::add_interaction(*system, "harmonic-bond", {{"within", 1.4}, {"stiffness", 20.0}, {"rest_length", 1.2}});
  test::add_interaction(*system, "lennard-jones",
                        {{"epsilon", 1.0},
                         {"sigma", 1.3},
                         {"cutoff", 1.9},
                         {"cut", std::string("switch")},
                         {"exclude", std::string("bonded")},
                         {"tail", true}});
  test::add_interaction(*system, "table",
                        {{"r", std::vector<double>{0.8, 1.1, 1.4, 1.8}},
                         {"value", std::vector<double>{2.0, 0.6, 0.2, 0.0}},
                         {"cut", std::string("force-shifted")}});
  return system;
}
TEST(Decomposition, BondedPairsLeftOut) {
  for (const char* method : {"psa", "cdda", "edda"}) compare<3>(chains, method, 0.01, 20, 20);
}
TEST(Decomposition, Fluid) {
  for (const auto& [method, given] : kMethods) compare<3>(yukawa(0.35), method, 0.01, 12, 15, given);
}
TEST(Decomposition, Cloud) {
  for (const auto& [method, given] : kMethods) compare<3>(cloud, method, 0.02, 30, 5, given);
}
/// There are so many particles that each rank has only a part of them.
TEST(Decomposition, ManySprings) {
  for (const char* method : {"verlet", "psa", "edda"}) {
    const std::uint64_t contacts = std::string(method) == "verlet" ? 0 : 400;
    const Counters c = compare<2>([] { return springs(40); }, method, 0.02, 60, contacts).counters;
    EXPECT_EQ(c.slabs_again, 0u) << method;  // wrong ghosts at the rim are corrected in the next slab
  }
}
TEST(Decomposition, Rod) {
  for (const char* method : {"psa", "edda"}) {
    const Statistics s = compare<3>(rod, method, 0.01, 40, 60);
    EXPECT_LT(s.counters.slabs_again, 5u) << method;
  }
}
/// Discs in a long strip, so dense that each collides more than once in two steps of 0.12.
std::unique_ptr<System<2>> strip() {
  std::vector<Vec<2>> x, v;
  for (int k = 0; k < 2400; ++k) {
    x.push_back({0.5 + 1.08 * (k / 12), 0.5 + 1.08 * (k % 12)});
    v.push_back({0.3 * (k * 7 % 11 - 5), 0.3 * (k * 5 % 13 - 6)});
  }
  return test::make_system<2>({216, 12.96}, Boundary::periodic, x, v);
}
/// Chains of collisions that reach from the rim of a rank's ghosts to its own particles.
TEST(Decomposition, GhostsThatGoWrong) {
  const auto bonded = [] {
    auto system = strip();
    test::add_interaction(*system, "harmonic-bond", {{"within", 1.2}, {"stiffness", 0.1}, {"rest_length", 1.1}});
    return system;
  };
  for (const char* method : {"psa", "edda"}) {
    const Counters c = compare<2>(bonded, method, 0.12, 5, 10000).counters;
    EXPECT_GT(c.slabs_again, c.slabs_by_all) << method;  // more ghosts were sufficient
  }
}
/// Ghosts go wrong that are too far to collide with own particles, but within the reach of forces: their owners tell
/// where they are.
TEST(Decomposition, GhostsThatGoWrongFarAway) {
  const auto attracted = [] {
    auto system = strip();
    test::add_interaction(*system, "yukawa", {{"amplitude", -1.0}, {"kappa", 0.3}, {"cutoff", 8.0}});
    return system;
  };
  EXPECT_EQ(compare<2>(attracted, "edda", 0.12, 5, 5000).counters.slabs_by_all, 0u);
}
/// Spins of ghosts go wrong, too, and are those of their owners before each step.
TEST(Decomposition, GhostsWithSpin) {
  const auto rough = [] {
    auto system = strip();
    test::set_law(*system, {{"tangential", 0.7}});
    for (Id i = 0; i < system->size(); ++i) system->particles.spin.push_back(Spin<2>::Constant(0.1 * (i % 7)));
    test::add_interaction(*system, "harmonic-bond", {{"within", 1.2}, {"stiffness", 0.1}, {"rest_length", 1.1}});
    return system;
  };
  for (const char* method : {"psa", "edda"})
    EXPECT_EQ(compare<2>(rough, method, 0.02, 40, 10000).counters.slabs_again, 0u) << method;
}
/// No rank has all particles: neither to find the bonds in its block nor to sum up forces over its own and its ghosts.
TEST(Decomposition, NoRankHasAllParticles) {
  const auto lattice = [] { return test::hard_spheres<2>(40, 0.5); };
  const test::Given bonds = {{"within", 1.4}, {"stiffness", 3.0}, {"rest_length", 1.2}};
  auto whole = lattice();
  test::add_interaction(*whole, "harmonic-bond", bonds);
  const Particles<2>& all = whole->particles;
  const double energy = evaluate_energy<2>(*whole, all.x).energy.value();
  std::vector<Vec<2>> forces(all.size());
  Counters uncounted;
  evaluate_forces<2>(*whole, all.x, forces, uncounted);
  test::ThreadRanks(8).run([&](Communicator& exchange) {
    auto system = lattice();
    system->decomposition.join(exchange);
    test::add_interaction(*system, "harmonic-bond", bonds);
    double reach = system->interactions[0]->reach(system->particles, exchange);
    exchange.largest({&reach, 1});
    EXPECT_EQ(reach, whole->interactions[0]->reach(all.x));
    system->quanta = quanta(*system);
    Particles<2>& p = system->particles;
    EXPECT_EQ(p.size(), all.size() / 8);
    system->decomposition.divide(true, 0.02);
    EXPECT_FALSE(system->decomposition.knows_all());
    EXPECT_EQ(system->size(), all.size());
    EXPECT_LT(p.size(), all.size() / 2);
    EXPECT_EQ(evaluate_energy<2>(*system, p.x).energy.value(), energy);
    std::vector<Vec<2>> felt(p.size());
    Counters mine;
    evaluate_forces<2>(*system, p.x, felt, mine);
    for (Id i = 0; i < p.size(); ++i) {
      EXPECT_EQ(p.x[i], all.x[p.id[i]]);
      EXPECT_EQ(felt[i], forces[p.id[i]]);
      if (p.owns(i)) p.x[i] += p.v[i];
    }
    system->decomposition.to_blocks();
    for (Id i = 0; i < p.size(); ++i) EXPECT_EQ(p.x[i], all.x[p.id[i]] + all.v[p.id[i]]);
  });
}
/// A liquid next to a gas of as many particles.
std::unique_ptr<System<3>> liquid_and_gas() {
  std::vector<Vec<3>> x, v;
  for (int k = 0; k < 1152; ++k) {
    x.push_back(1.1 * Vec<3>(k / 36 + 0.5, k / 6 % 6 + 0.5, k % 6 + 0.5));
    x.push_back(Vec<3>(35.2, 0, 0) + 2.2 * Vec<3>(k / 9 + 0.5, k / 3 % 3 + 0.5, k % 3 + 0.5));
    for (const std::size_t last : {x.size() - 2, x.size() - 1}) {
      x[last][0] += 0.015 * (k % 7 - 3);  // cuts may divide a layer
      v.push_back({0.4 * (k % 7 - 3), 0.5 * (k % 5 - 2), 0.6 * (k % 3 - 1)});
    }
  }
  auto system = test::make_system<3>({316.8, 6.6, 6.6}, Boundary::periodic, x, v);
  test::add_interaction(*system, "yukawa", {{"amplitude", 0.1}, {"kappa", 1.0}, {"cutoff", 2.5}});
  return system;
}
TEST(Decomposition, LiquidAndGas) {
  for (const char* method : {"psa", "edda"}) compare<3>(liquid_and_gas, method, 0.02, 12, 100);
}
/// Ranks get equal shares of the pairs, not of the particles, once there are lists of pairs.
TEST(Decomposition, RanksShareTheWork) {
  for (const int ranks : {2, 3, 8}) {
    SCOPED_TRACE(ranks);
    std::vector<double> work(static_cast<std::size_t>(ranks));
    test::ThreadRanks(ranks).run([&](Communicator& exchange) {
      auto system = liquid_and_gas();
      system->decomposition.join(exchange);
      system->quanta = quanta(*system);
      system->decomposition.divide(true, 0.02);
      const Particles<3>& p = system->particles;
      const auto pairs_here = [&] { return static_cast<double>(system->interactions[0]->interacting_pairs(p.x)); };
      pairs_here();  // makes a list
      EXPECT_TRUE(system->decomposition.divide_if_due(1, 0.02));
      double& mine = work[static_cast<std::size_t>(exchange.rank())] = pairs_here();
      for (Id i = 0; i < p.size(); ++i) mine += p.owns(i) ? 20 : 0;
      EXPECT_FALSE(system->decomposition.divide_if_due(2, 0.02));
    });
    const double all = std::accumulate(work.begin(), work.end(), 0.0);
    EXPECT_LT(std::ranges::max(work), 1.2 * all / ranks);  // 1.45 with equal numbers of particles
  }
}
/// Ions in a long box, some spheres without charge, one ion fixed if `fixed`; between charged walls if there is no
/// surface. Bonded ions do not act on each other.
std::unique_ptr<System<3>> ions(const std::string& surface, bool fixed = false) {
  std::vector<Vec<3>> x, v;
  std::vector<double> radius, mass;
  for (int k = 0; k < 512; ++k) {
    x.push_back(1.7 * Vec<3>(k / 16 + 0.5, k / 4 % 4 + 0.5, k % 4 + 0.5));
    v.push_back({0.4 * (k % 7 - 3), 0.5 * (k % 5 - 2), 0.6 * (k % 3 - 1)});
    radius.push_back(0.8);
    mass.push_back(1.0 + 0.5 * (k % 4));
  }
  auto system = test::make_system<3>({54.4, 6.8, 6.8}, Boundary::periodic, x, v, radius, mass);
  Particles<3>& p = system->particles;
  for (Id i = 0; i < p.size(); ++i) p.charge[i] = i % 5 == 4 ? 0 : i % 5 < 2 ? 1.5 : -1.5;
  for (const Id i : {510, 511}) p.charge[i] = 0;
  if (fixed) p.mass[7] = std::numeric_limits<double>::infinity(), p.v[7] = Vec<3>::Zero();
  Given given = {{"constant", 1.0}, {"form", std::string("ewald")}, {"accuracy", 0.01}};
  if (surface.empty()) {
    system->box.boundary[2] = Boundary::wall;
    p.charge[5] += 1.25;
    given.set("wall_charges", std::vector<double>{-0.01, 0.01 - 1.25 / (54.4 * 6.8)});
  } else {
    given.set("surface", surface);
    given.set("exclude", std::string("bonded"));
    test::add_interaction(*system, "harmonic-bond",
                          {{"pairs", PairList{{0, 1}, {17, 33}, {511, 3}}}, {"stiffness", 1.0}, {"rest_length", 1.7}});
  }
  test::add_interaction(*system, "coulomb", given);
  return system;
}
TEST(Decomposition, Ions) {
  for (const char* method : {"psa", "edda"}) {
    compare<3>([] { return ions("vacuum"); }, method, 0.02, 12, 100);
    compare<3>([] { return ions(""); }, method, 0.02, 4, 20);
  }
  compare<3>([] { return ions("conducting", true); }, "edda", 0.02, 6, 60);
  for (const char* method : {"mcva", "cdda"}) compare<3>([] { return ions("vacuum"); }, method, 0.014, 3, 1);
  const auto points = [] {
    auto system = ions("conducting");
    std::ranges::fill(system->particles.radius, 1e-3);
    return system;
  };
  compare<3>(points, "verlet", 0.02, 20, 0);
}
/// S(k), the net force and the motion of the centre of mass are sums over the ranks.
TEST(Decomposition, NoRankHasAllIons) {
  for (const bool fixed : {false, true}) {
    const auto start = [&] { return ions(fixed ? "conducting" : "vacuum", fixed); };
    struct Sums {
      double energy;
      std::vector<Vec<3>> force, mean, product;
      double energy_of_few;  // after a motion of which most ranks know nothing
    };
    const auto sums = [](const System<3>& system) {
      const Particles<3>& p = system.particles;
      std::vector<Vec<3>> x_new = p.x;
      for (Id i = 0; i < p.size(); ++i) x_new[i] += 0.3 * p.v[i] + (p.fixed(i) ? Vec<3>::Zero() : Vec<3>(0.2, 0.1, 0));
      Sums all{evaluate_energy<3>(system, p.x).energy.value(), p.x, p.x, p.x, 0};
      Counters uncounted;
      evaluate_forces<3>(system, p.x, all.force, uncounted);
      evaluate_mean_forces<3>(system, p.x, x_new, all.mean, uncounted);
      evaluate_hessian_product<3>(system, p.x, p.v, all.product, uncounted);
      for (Id i = 0; i < p.size(); ++i) x_new[i] = p.x[i] + (p.id_of(i) < 6 ? Vec<3>(0.1, 0, 0) : Vec<3>::Zero());
      all.energy_of_few = evaluate_energy<3>(system, x_new).energy.value();
      return all;
    };
    auto whole = start();
    whole->quanta = quanta(*whole);
    const Sums expected = sums(*whole);
    test::ThreadRanks(8).run([&](Communicator& exchange) {
      auto system = start();
      system->quanta = whole->quanta;
      system->decomposition.join(exchange);
      system->decomposition.divide(true, 0.02);
      const Particles<3>& p = system->particles;
      EXPECT_LE(p.size(), whole->size() / 2);
      const Sums found = sums(*system);
      EXPECT_EQ(found.energy, expected.energy);
      EXPECT_EQ(found.energy_of_few, expected.energy_of_few);
      for (Id i = 0; i < p.size(); ++i) {
        EXPECT_EQ(found.force[i], expected.force[p.id[i]]);
        EXPECT_EQ(found.mean[i], expected.mean[p.id[i]]);
        EXPECT_EQ(found.product[i], expected.product[p.id[i]]);
      }
    });
  }
}
/// A division allows for steps twice as long as its longest.
TEST(Decomposition, StepsGiveGhostsTheirPositionsAndAreNotTooLong) {
  constexpr double kStep = 0.02;
  test::ThreadRanks(8).run([](Communicator& exchange) {
    auto system = test::hard_spheres<2>(40, 0.5);
    system->particles.v.assign(system->size(), Vec<2>(1, 0));
    Decomposition<2>& decomposition = system->decomposition;
    decomposition.join(exchange);
    decomposition.divide(true, kStep);
    ASSERT_FALSE(decomposition.knows_all());
    const Particles<2>& p = system->particles;
    // Only the last rank has other velocities. Those of copies are ignored.
    const auto enough = [&](double speed) {
      std::vector<Vec<2>> x = p.x, v(p.size(), Vec<2>(1, 0));
      for (Id i = 0; i < p.size(); ++i)
        if (!p.owns(i))
          x[i] = {0, 0}, v[i] = {1e9, 0};
        else if (exchange.rank() == 7)
          v[i] = {speed, 0};
      decomposition.start_step(x, v, kStep);
      try {
        decomposition.finish_step(x);
      } catch (HaloTooSmall) {
        return false;
      }
      EXPECT_EQ(x, p.x);
      return true;
    };
    EXPECT_TRUE(enough(1.99));
    EXPECT_FALSE(enough(2.01));
    EXPECT_FALSE(enough(-2.01));
  });
}
/// Steps this long have collisions whose effects reach beyond a rank's ghosts.
TEST(Decomposition, StepsThatTakeAllParticles) {
  EXPECT_GT(compare<2>([] { return springs(40); }, "psa", 0.5, 2, 1000).counters.slabs_by_all, 0u);
}
TEST(Decomposition, WithoutCores) {
  for (const auto& scene : {yukawa(0.1), yukawa(0.3)}) compare<3>(scene, "verlet", 0.01, 150, 0);
}
/// A channel narrower than the cutoff, in which each disc meets its own images; charges of both signs.
TEST(Decomposition, OwnImages) {
  const auto channel = [] {
    std::vector<Vec<2>> x, v;
    for (int i = 0; i < 150; ++i) {
      x.push_back({0.4 + 0.8 * (i / 2), 0.1 + 0.85 * (i % 2)});
      v.push_back({std::sin(37.0 * i), std::cos(11.0 * i)});
    }
    auto system = test::make_system<2>({60, 1.7}, Boundary::periodic, x, v, std::vector<double>(150, 0.3));
    for (Id i = 0; i < 150; ++i) system->particles.charge[i] = i % 3 == 0 ? -1.5 : 1;
    test::add_interaction(
        *system, "yukawa",
        {{"amplitude", 1.0}, {"kappa", 1.0}, {"charges", true}, {"cutoff", 3.6}, {"cut", std::string("shifted")}});
    return system;
  };
  for (const char* method : {"verlet", "psa", "edda"}) compare<2>(channel, method, 0.02, 12, method[0] == 'v' ? 0 : 20);
}
/// The final error of a run of free discs on each of this many ranks; 0: without ranks.
std::string failure_of(const System<2>& start, const IntegratorInfo& info, const Given& given, int ranks) {
  std::vector<std::string> all(static_cast<std::size_t>(std::max(ranks, 1)));
  test::ThreadRanks(std::max(ranks, 1)).run([&](Communicator& exchange) {
    auto system = std::make_unique<System<2>>();
    system->box = start.box;
    system->particles = start.particles;
    if (ranks > 0) system->decomposition.join(exchange);
    try {
      Simulation<2>(std::move(system), info, given, {.steps = 1}).run();
    } catch (const Error& e) {
      all[static_cast<std::size_t>(exchange.rank())] = e.what();
    }
  });
  for (const std::string& each : all) EXPECT_EQ(each, all[0]);
  return all[0];
}
TEST(Decomposition, TheOutermostSphereIsNamedByItsId) {
  auto system = test::hard_spheres<2>(4, 0.3);
  system->box.boundary = {Boundary::wall, Boundary::periodic};
  for (Vec<2>& x : system->particles.x) x[0] = std::clamp(x[0], 0.5, system->box.edges[0] - 0.5);
  const Id last = static_cast<Id>(system->size()) - 2;
  system->particles.x[3][0] = 0.4;
  system->particles.x[last][0] = 0.2;
  for (const int ranks : {0, 2, 3}) {
    const std::string message = failure_of(*system, find_integrator("free-flight"), {{"step", 1.0}}, ranks);
    EXPECT_TRUE(
        message.starts_with("particle " + std::to_string(last) + " reaches 0.3 beyond the lower wall of axis 0"))
        << message;
  }
}
/// Two discs move into each other, which no method allows; the narrow subdomain of three other discs lies between them.
TEST(Decomposition, TheDeepestOverlapIsFoundAcrossRanks) {
  const Vec<2> rest = {0, 0};
  const auto system =
      test::make_system<2>({60, 12}, Boundary::periodic,
                           {{8, 1}, {10, 1}, {14.3, 1}, {15, 3}, {15, 6}, {15, 9}, {15.7, 1}, {20, 1}, {22, 1}},
                           {rest, rest, {0.25, 0}, rest, rest, rest, {-0.25, 0}, rest, rest});
  IntegratorInfo info = find_integrator("verlet");
  info.hard_cores = true, info.smooth_forces = false;
  for (const bool stepping : {true, false})  // without steps, as in free flight, there is no list of pairs
    for (const int ranks : {0, 1, 2, 3, 4}) {
      info.stepping = stepping;
      const std::string message = failure_of(*system, info, {{"step", 1.0}}, ranks);
      EXPECT_TRUE(message.starts_with("particles 2 and 6 overlap, by 0.1 of their contact distance"))
          << ranks << ": " << message;
    }
}
/// Three piles at rest. In version 1.1.0 their overlaps grew to 2e-5 of the contact distance.
TEST(Decomposition, PilesDoNotOverlap) {
  const auto pile = [](Vec<2> edges, std::vector<Vec<2>> x, std::vector<Vec<2>> v, double radius, double sideways,
                       double restitution) {
    const std::size_t n = x.size();
    auto system =
        test::make_system<2>(edges, Boundary::wall, std::move(x), std::move(v), std::vector<double>(n, radius));
    test::set_law<2>(*system, {{"restitution", restitution}});
    test::add_interaction(*system, "uniform-field", {{"acceleration", std::vector<double>{sideways, -1.0}}});
    return system;
  };
  const auto meeting = [&] {
    return pile({5.3, 10}, {{4.323, 1.303}, {3.183, 2.956}, {4.309, 2.451}}, {{0.4, 0}, {0.4, 0}, {0.18, 0}}, 0.5, 0,
                0);
  };
  const auto layers = [&] {
    const Vec<2> rest = {0, 0};
    auto system =
        pile({4.2, 14}, {{0.577, 1.003}, {1.685, 0.988}, {2.85, 0.998}, {0.614, 2.096}, {1.736, 2.073}, {2.75, 2.112}},
             {rest, rest, rest, rest, rest, rest}, 0.45, 0.2, 0.99);
    test::set_law<2>(*system,
                     {{"between", std::vector<std::string>{"*", "y-"}}, {"restitution", 0.5}, {"rest_speed", 0.01}});
    return system;
  };
  const auto column = [&] {
    return pile({4.2, 14}, {{0.574, 1.011}, {1.695, 1.02}, {2.824, 1.038}}, {{0, 0}, {0, 0}, {0, 0}}, 0.45, 0.2, 0.8);
  };
  struct Case {
    Scene<2> scene;
    std::string method;
    double step, end_time = 13;
  };
  for (const Case& c : {Case{meeting, "cva", 0.005, 2.1}, Case{column, "edda", 0.018}, Case{column, "edda", 0.02},
                        Case{layers, "edda", 0.02}, Case{layers, "cdda", 0.02}, Case{layers, "psa", 0.02}}) {
    SCOPED_TRACE(c.method + " " + std::to_string(c.step));
    const auto run = [&](Communicator* ranks) {
      auto system = c.scene();
      if (ranks) system->decomposition.join(*ranks);
      const auto simulation = test::make_run<2>(std::move(system), c.method, {.step = c.step, .end_time = c.end_time});
      simulation->run();
      return simulation->statistics();
    };
    const Statistics alone = run(nullptr);
    EXPECT_LT(alone.counters.max_overlap, 1e-11);
    if (find_integrator(c.method).exact) {
      EXPECT_LT(alone.max_energy_error, 1e-12 * alone.energy_reference);
    }
    test::ThreadRanks(2).run([&](Communicator& exchange) { test::expect_same(alone, run(&exchange)); });
  }
}
/// Two pairs, each on its own rank if there are several.
TEST(Decomposition, OfOverlapsAlikeTheOneWithTheLowestIdsIsNamed) {
  const Vec<2> rest = {0, 0}, right = {0.25, 0}, left = {-0.25, 0};
  const auto system = test::make_system<2>(
      {64, 12}, Boundary::periodic,
      {{8, 1}, {10, 1}, {14.3125, 4}, {46.3125, 4}, {30, 6}, {47.6875, 4}, {15.6875, 4}, {50, 1}, {52, 1}},
      {rest, rest, right, right, rest, left, left, rest, rest});
  IntegratorInfo info = find_integrator("verlet");
  info.hard_cores = true, info.smooth_forces = false;
  for (const int ranks : {0, 1, 2, 3}) {
    const std::string message = failure_of(*system, info, {{"step", 1.0}}, ranks);
    EXPECT_TRUE(message.starts_with("particles 2 and 6 overlap, by 0.125 of their contact distance"))
        << ranks << ": " << message;
  }
}
TEST(Decomposition, TheFastestSphereIsNamedByItsId) {
  const auto system = test::hard_spheres<2>(4, 0.3);
  const Id last = static_cast<Id>(system->size()) - 2;
  system->particles.v[last] = {1e200, 0};
  for (const int ranks : {0, 2, 3}) {
    const std::string message = failure_of(*system, find_integrator("free-flight"), {{"step", 1.0}}, ranks);
    EXPECT_NE(message.find("particle " + std::to_string(last) + " is the fastest"), std::string::npos) << message;
  }
}
/// Discs joined to their neighbours by springs so stiff that sweeps are accelerated.
Scene<2> stiff(int cells, double packing_fraction) {
  return [=] {
    auto system = test::hard_spheres<2>(cells, packing_fraction);
    test::add_interaction(*system, "harmonic-bond", {{"within", 1.4}, {"stiffness", 300.0}, {"rest_length", 1.0}});
    return system;
  };
}
/// Neighbours bounce so often in a step that the order of some collisions changes between sweeps.
TEST(Decomposition, ParticlesThatAreFrozen) {
  const Counters c = compare<2>(stiff(40, 0.74), "edda", 0.04, 24, 300).counters;
  EXPECT_GT(c.frozen, 0u);
  EXPECT_EQ(c.slabs_by_all, 0u);
}
TEST(Decomposition, StiffForces) {
  EXPECT_GT(compare<2>(stiff(7, 0.5), "edda", 0.05, 12, 0).counters.fallbacks, 0u);
  const Counters many = compare<2>(stiff(30, 0.5), "edda", 0.05, 2, 0).counters;
  EXPECT_GT(many.fallbacks, 0u);
}

}  // namespace
}  // namespace carom::decomposition_test
