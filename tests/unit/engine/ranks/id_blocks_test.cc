// SPDX-License-Identifier: BSD-3-Clause
// Free flight on ranks that have blocks of the particles, against one rank with all particles.

#include "engine/ranks/id_blocks.h"

#include <gtest/gtest.h>

#include "engine/ranks/bisection.h"
#include "engine/run/simulation.h"
#include "tests/support/thread_ranks.h"
#include "tests/unit/engine/events/event_cases.h"

namespace carom::id_blocks_test {
namespace {

/// Everything that a run reports.
template <int D>
struct Account : Observer<D> {
  Sampling sampling() const override { return {.interval = 0.11}; }
  void sample(double, const Particles<D>& state) override { states.push_back(state); }
  void frame(const Snapshot<D>& shot) override {
    states.push_back(ranks ? gathered(*ranks, *shot.particles) : *shot.particles);
  }
  void thermo(const Snapshot<D>& shot) override {
    EXPECT_GT(shot.temperature, 0) << "at time " << shot.time;
    values.insert(values.end(), {shot.time, shot.kinetic, shot.potential, shot.pressure, shot.temperature});
    for (int k = 0; k < D; ++k) values.push_back(shot.momentum[k]);
  }
  void contacts(double, std::span<const Contact<D>> all) override {
    for (const auto& contact : all) events.push_back(contact.key);
  }
  std::vector<Particles<D>> states;
  std::vector<EventKey<D>> events;
  std::vector<double> values;
  double overlap = 0;
  std::size_t kept = 0;  // particles here at the end
  Communicator* ranks = nullptr;
};

template <int D>
using Scene = std::function<std::unique_ptr<System<D>>()>;

template <int D>
Account<D> run(const Scene<D>& scene, Communicator* ranks) {
  auto system = scene();
  if (ranks) system->decomposition.join(*ranks);
  auto run =
      test::make_run<D>(std::move(system), "free-flight",
                        {.step = 0.3, .end_time = 0.8, .frame_interval = 0.2, .thermo_interval = 0.07, .events = true});
  Account<D> account;
  account.ranks = ranks;
  run->add(account);
  run->run();
  const Statistics& s = run->statistics();
  account.values.insert(account.values.end(), {s.max_energy_error, s.counters.max_overlap, s.mean_pressure,
                                               *s.mean_free_path, static_cast<double>(s.counters.sphere_sphere)});
  account.overlap = s.counters.max_overlap;
  account.kept = run->system().particles.size();
  return account;
}

template <int D>
void compare(const Scene<D>& scene, std::size_t contacts) {
  const Account<D> alone = run<D>(scene, nullptr);
  ASSERT_GE(alone.events.size(), contacts);
  for (const int ranks : {2, 3, 5}) {
    SCOPED_TRACE(ranks);
    std::vector<Account<D>> all(static_cast<std::size_t>(ranks));
    test::ThreadRanks(ranks).run(
        [&](Communicator& exchange) { all[static_cast<std::size_t>(exchange.rank())] = run<D>(scene, &exchange); });
    const Account<D>& first = all.front();
    EXPECT_EQ(first.events, alone.events);
    ASSERT_EQ(first.states.size(), alone.states.size());
    for (std::size_t k = 0; k < first.states.size(); ++k) {
      const Particles<D>&a = first.states[k], &b = alone.states[k];
      EXPECT_EQ(a.x, b.x) << k;
      EXPECT_EQ(a.v, b.v) << k;
      EXPECT_EQ(a.image, b.image) << k;
      EXPECT_EQ(a.mass, b.mass) << k;
      EXPECT_EQ(a.radius, b.radius) << k;
      EXPECT_EQ(a.species, b.species) << k;
    }
    const std::size_t n = alone.kept;
    for (const Account<D>& each : all) {
      EXPECT_EQ(each.values, alone.values);
      EXPECT_LE(each.kept, n / all.size() + 1);
    }
    if (::testing::Test::HasFailure()) break;
  }
}

TEST(IdBlocks, Fluid) {
  compare<3>([] { return test::hard_spheres<3>(5, 0.3); }, 1500);
}
TEST(IdBlocks, ManySizesBetweenWalls) {
  compare<2>(
      [] {
        auto system = random_system<2>(120, {21, 21}, {P, W}, 0.15, 1.5, 4);
        test::add_interaction(*system, "uniform-field", {{"acceleration", std::vector<double>{0.0, -0.5}}});
        return system;
      },
      300);
}
TEST(IdBlocks, Species) {
  compare<3>(
      [] {
        auto system = random_system<3>(200, {8, 8, 8}, {O, P, P}, 0.5, 0.5, 9);
        system->species = {"light", "heavy"};
        for (std::size_t i = 0; i < 200; i += 3) system->particles.species[i] = 1, system->particles.mass[i] = 2.5;
        return system;
      },
      100);
}

/// Two spheres that overlap and never move are found for all ranks and all divisions of the box.
TEST(IdBlocks, OverlapsAreFound) {
  const auto grid = [] {
    std::vector<Vec<3>> x, v(125, Vec<3>::Zero());
    for (int k = 0; k < 125; ++k) x.push_back({1.0 + 2 * (k / 25), 1.0 + 2 * (k / 5 % 5), 1.0 + 2 * (k % 5)});
    x[1] = x[0] + Vec<3>(0, 0, 0.99);
    v[124] = {0, 0, -3};
    return test::make_system<3>({10, 10, 10}, P, x, v);
  };
  const auto refused = [&](Communicator* ranks) {
    try {
      run<3>(grid, ranks);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const std::string alone = refused(nullptr);
  EXPECT_NE(alone.find("particles 0 and 1 overlap, by 0.01"), std::string::npos) << alone;
  for (const int ranks : {2, 3, 5})
    test::ThreadRanks(ranks).run([&](Communicator& each) { EXPECT_EQ(refused(&each), alone); });
}

TEST(Sizes, AreThoseOfTheSpeciesWhereTheyAreEqual) {
  auto system = random_system<2>(30, {21, 21}, {P, P}, 0.5, 0.5, 4);
  Particles<2>& p = system->particles;
  for (std::size_t i = 0; i < 30; i += 2) p.species[i] = 1, p.radius[i] = 0.25;
  const Sizes by_species(p);
  EXPECT_TRUE(by_species.by_species);
  EXPECT_EQ(by_species.radius, (std::vector<double>{0.5, 0.25}));
  EXPECT_EQ(by_species.number, (std::vector<double>{15, 15}));
  p.mass[7] = 3;
  const Sizes by_id(p);
  EXPECT_FALSE(by_id.by_species);
  EXPECT_EQ(by_id.radius_of(4, 1), 0.25);
  EXPECT_EQ(by_id.mass_of(7, 0), 3);
  EXPECT_EQ(by_id.largest_radius(), 0.5);
}

/// The distribution of spheres among the ranks does not matter, even with many equal coordinates.
TEST(Bisection, HasTheSameCutsOnAnyNumberOfRanks) {
  for (const bool layers : {false, true}) {
    auto system = random_system<3>(500, {30, 12, 12}, {O, P, W}, 0.3, 0.3, 3);
    auto& x = system->particles.x;
    for (Vec<3>& at : x)
      if (layers) at = at.array().round();
    Communicator alone;
    const Bisection<3> whole(system->box, x, 7, 1.0, alone);
    std::vector<std::size_t> spheres(7);
    for (const Vec<3>& at : x) ++spheres[whole.owner(at)];
    for (const std::size_t n : spheres) EXPECT_NEAR(static_cast<double>(n), 500.0 / 7, layers ? 40 : 5);
    test::ThreadRanks(3).run([&](Communicator& ranks) {
      std::vector<Vec<3>> some;  // one rank has no particles
      for (std::size_t i = 0; i < x.size(); ++i)
        if (static_cast<int>(i % 2) == ranks.rank()) some.push_back(x[i]);
      const Bisection<3> bisection(system->box, some, 7, 1.0, ranks);
      for (std::uint32_t i = 0; i < 5000; ++i) {
        RandomStream random(2, RandomPurpose::probe, i);
        Vec<3> at;
        for (int k = 0; k < 3; ++k) at[k] = random.uniform() * system->box.edges[k];
        ASSERT_EQ(bisection.owner(at), whole.owner(at));
      }
    });
  }
}

/// Spheres in a row of 1000; the spheres at the left have three times as much work.
TEST(Bisection, GivesEachTheSameWork) {
  const Box<2> box{{100, 10}, {W, W}};
  std::vector<Vec<2>> x;
  std::vector<std::uint32_t> work;
  for (int i = 0; i < 1000; ++i) {
    x.push_back({0.1 * i + 0.05, 5});
    work.push_back(i < 500 ? 3 : 1);
  }
  Communicator alone;
  const Bisection<2> bisection(box, x, 4, 1.0, alone, work);
  std::vector<std::uint32_t> shares(4);
  for (std::size_t i = 0; i < x.size(); ++i) shares[bisection.owner(x[i])] += work[i];
  for (const std::uint32_t share : shares) EXPECT_NEAR(share, 500, 3);
  EXPECT_EQ(bisection.owner({16.5, 5}), 0u);
  EXPECT_EQ(bisection.owner({16.7, 5}), 1u);
}

}  // namespace
}  // namespace carom::id_blocks_test
