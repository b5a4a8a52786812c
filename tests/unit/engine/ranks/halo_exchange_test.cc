// SPDX-License-Identifier: BSD-3-Clause
// The halos of random particles in a bisection: owners, relevant copies, and values that owners send.

#include "engine/ranks/halo_exchange.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

#include "engine/ranks/bisection.h"
#include "tests/support/thread_ranks.h"

namespace carom::halo_exchange_test {
namespace {

constexpr double kNear = 1.0, kFar = 1.8;
const Box<2> kBox{{12, 9}, {Boundary::periodic, Boundary::wall}};

std::vector<Vec<2>> random_places() {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<Vec<2>> x;
  for (int i = 0; i < 300; ++i) x.emplace_back(kBox.edges[0] * uniform(random), kBox.edges[1] * uniform(random));
  return x;
}

/// The part of all particles that one of four ranks has.
struct Known {
  explicit Known(int me, bool one_sided = false) : bisection(kBox, random_places(), 4, kFar, alone) {
    const std::vector<Vec<2>> all = random_places();
    for (Id i = 0; i < all.size(); ++i)
      for_each_receiver(bisection, all[i], one_sided, [&](std::uint32_t rank) {
        if (rank != static_cast<std::uint32_t>(me)) return;
        p.id.push_back(i);
        p.x.push_back(all[i]);
        owner.push_back(static_cast<int>(bisection.owner(all[i])));
      });
    p.image.resize(p.size());
    p.ghost.resize(p.size());
    halo.assign(bisection, kBox, p, me, kNear, one_sided);
  }
  Communicator alone;
  Bisection<2> bisection;
  Particles<2> p;
  std::vector<int> owner;
  HaloExchange<2> halo;
};

TEST(HaloExchange, CopiesNearOwnParticlesMatter) {
  for (const int me : {0, 1, 2, 3}) {
    const Known known(me);
    std::size_t mattering = 0;
    for (Id g = 0; g < known.p.size(); ++g) {
      EXPECT_EQ(known.p.owns(g), known.owner[g] == me);
      if (known.p.owns(g)) {
        EXPECT_FALSE(known.halo.matters(g));
        continue;
      }
      mattering += known.halo.matters(g) ? 1 : 0;
      for (Id i = 0; i < known.p.size(); ++i) {
        Vec<2> d = known.p.x[g] - known.p.x[i];
        d[0] -= kBox.edges[0] * std::round(d[0] / kBox.edges[0]);
        EXPECT_TRUE(known.halo.matters(g) || !known.p.owns(i) || d.norm() > kNear);
      }
    }
    EXPECT_GT(mattering, 20u);
    EXPECT_LT(mattering, known.p.size() - 80);
  }
}

TEST(HaloExchange, CopiesGetTheValuesOfTheirOwners) {
  test::ThreadRanks(4).run([](Communicator& ranks) {
    const Known known(ranks.rank());
    std::vector<double> one(known.p.size(), -1);
    std::vector<Vec<2>> other(known.p.size(), {-1, -1});
    for (Id i = 0; i < known.p.size(); ++i)
      if (known.p.owns(i)) one[i] = 2.0 * known.p.id[i], other[i] = {1.0 * known.p.id[i], 5};
    known.halo.update(ranks, std::span(one), std::span(other));
    for (Id i = 0; i < known.p.size(); ++i) {
      EXPECT_EQ(one[i], 2.0 * known.p.id[i]);
      EXPECT_EQ(other[i], Vec<2>(known.p.id[i], 5));
    }
  });
}

/// One rank evaluates each pair within reach, also if ghosts are one-sided: then it still has both particles.
TEST(HaloExchange, OneRankEvaluatesEachPair) {
  const std::vector<Vec<2>> all = random_places();
  for (const bool one_sided : {false, true}) {
    std::map<std::pair<Id, Id>, int> ranks;
    std::map<char, int> ghosts;
    for (const int me : {0, 1, 2, 3}) {
      const Known known(me, one_sided);
      for (Id g = 0; g < known.p.size(); ++g)
        for (Id i = 0; i < known.p.size(); ++i) {
          if (known.p.owns(g) || !known.p.owns(i)) continue;
          ++ghosts[known.p.ghost[g]];
          EXPECT_EQ(known.p.evaluates(i, g), known.p.evaluates(g, i));
          if (known.p.evaluates(i, g)) ++ranks[std::minmax(known.p.id[i], known.p.id[g])];
        }
    }
    const Known known(0);
    for (Id i = 0; i < all.size(); ++i)
      for (Id j = i + 1; j < all.size(); ++j) {
        Vec<2> d = all[i] - all[j];
        d[0] -= kBox.edges[0] * std::round(d[0] / kBox.edges[0]);
        if (d.norm() > kFar || known.bisection.owner(all[i]) == known.bisection.owner(all[j])) continue;
        EXPECT_EQ((ranks[{i, j}]), 1) << i << ' ' << j;
      }
    EXPECT_GT(ghosts[kGhost], 0);  // beyond the cut across the axis with walls
    EXPECT_GT(ghosts[kGhostHere], 0);
    EXPECT_EQ(ghosts[kGhostElsewhere] > 0, !one_sided);
  }
}

/// Small forces, those of one rank so large that they need high words, and sums that have no room for more.
TEST(HaloExchange, OwnersAddTheForcesOnCopies) {
  using Whole = ForceSums<2>::Whole;
  for (const double large : {1.0, 0x1p70, 0x1p84}) {
    const auto force = [&](int rank, Id id) {
      const double size = 1000 * rank + static_cast<double>(id);
      return rank == 2 ? Vec<2>(large + size, -size) : Vec<2>(-size, size - 3);
    };
    std::array<std::map<Id, std::array<Whole, 2>>, 4> own;
    std::array<std::map<Id, std::array<Whole, 2>>, 4> expected;
    test::ThreadRanks(4).run([&](Communicator& ranks) {
      const auto me = static_cast<std::size_t>(ranks.rank());
      const Known known(ranks.rank());
      ForceSums<2> sums(known.p.size(), 1);
      const ForceLimits limits = sums.make_room(3);
      for (Id i = 0; i < known.p.size(); ++i) {
        if (known.p.ghost[i] == kGhostElsewhere) continue;
        ASSERT_TRUE(sums.add(i, force(ranks.rank(), known.p.id[i]), limits));
        expected[me][known.p.id[i]] = sums.quanta(i);
      }
      EXPECT_TRUE(known.halo.add_ghosts(ranks, sums));
      EXPECT_TRUE(known.halo.add_ghosts(ranks, sums));  // nothing is left to be added
      for (Id i = 0; i < known.p.size(); ++i)
        if (known.p.owns(i))
          own[me][known.p.id[i]] = sums.quanta(i);
        else
          EXPECT_EQ(sums.value(i), Vec<2>(0, 0));
      if (me == 1) sums.invalidate();
      EXPECT_FALSE(known.halo.add_ghosts(ranks, sums));  // on all ranks: they must decide alike
    });
    std::size_t shared = 0, particles = 0;
    for (const auto& of_rank : own)
      for (const auto& [id, sum] : of_rank) {
        ++particles;
        std::array<Whole, 2> all{};
        int ranks = 0;
        for (const auto& each : expected)
          if (const auto at = each.find(id); at != each.end())
            for (const int k : {0, 1}) all[k] += at->second[k], ranks += k;
        shared += ranks > 1 ? 1 : 0;
        EXPECT_TRUE(sum == all) << id << ' ' << large;
      }
    EXPECT_EQ(particles, 300u);
    EXPECT_GT(shared, 100u);
  }
}

TEST(HaloExchange, SumsWithoutRoomForTheForcesOnCopiesAreInvalid) {
  ForceSums<2> sums(1, 1);
  sums.make_room(1);
  const std::array<Id, 1> first{0};
  const std::array<ForceSums<2>::Words, 1> large{{{std::int64_t{1} << 61, 0}}};
  for (int k = 0; k < 5; ++k) sums.add(first, large, false);
  EXPECT_TRUE(sums.quanta(0)[0] == ForceSums<2>::Whole{5} << 61);  // low words are carried into high ones
  sums.add(first, large, true);
  EXPECT_TRUE(sums.value(0).allFinite());
  sums.add(first, large, true);
  sums.add(first, large, true);
  EXPECT_FALSE(sums.value(0).allFinite());
}

TEST(HaloExchange, KnowsHowFarOwnParticlesHaveCome) {
  Known known(0);
  for (Id i = 0; i < known.p.size(); ++i) {
    known.p.x[i][1] += known.p.owns(i) ? 0.25 : 7;
    known.p.x[i][0] -= kBox.edges[0];
    known.p.image[i][0] += 1;
  }
  EXPECT_NEAR(known.halo.squared_farthest(kBox, known.p, known.p.x), 0.0625, 1e-12);
}

}  // namespace
}  // namespace carom::halo_exchange_test
