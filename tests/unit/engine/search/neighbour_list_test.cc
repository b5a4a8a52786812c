// SPDX-License-Identifier: BSD-3-Clause
#include "engine/search/neighbour_list.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <set>

#include "engine/base/error.h"
#include "engine/search/sized_cells.h"

namespace carom::neighbour_list_test {
namespace {

/// Every pair and image within reach, by brute force.
template <int D>
std::set<NeighbourPair<D>> brute_force(const Box<D>& box, const std::vector<Vec<D>>& x,
                                       const std::vector<double>& reach) {
  std::set<NeighbourPair<D>> pairs;
  Image<D> image;
  const int images = 27;  // offsets −1…1 per axis, as digits of base 3; boxes here are wider than half the reach
  for (Id i = 0; i < x.size(); ++i)
    for (Id j = i + 1; j < x.size(); ++j)
      for (int code = 0; code < images; ++code) {
        int digits = code;
        bool allowed = true;
        for (int k = 0; k < D; ++k, digits /= 3) {
          image[k] = digits % 3 - 1;
          allowed = allowed && (image[k] == 0 || box.periodic(k));
        }
        if (digits != 0 || !allowed) continue;
        if ((x[i] - x[j] + box.shift(image)).norm() <= reach[i] + reach[j]) pairs.insert({i, j, image});
      }
  return pairs;
}

template <int D>
void expect_covered(const Box<D>& box, const std::vector<Vec<D>>& x, const std::vector<double>& reach,
                    std::span<const NeighbourPair<D>> pairs) {
  const std::set<NeighbourPair<D>> listed(pairs.begin(), pairs.end());
  ASSERT_EQ(listed.size(), pairs.size()) << "a pair is listed twice";
  ASSERT_TRUE(std::ranges::is_sorted(pairs));
  for (const auto& pair : brute_force<D>(box, x, reach))
    EXPECT_TRUE(listed.contains(pair)) << pair.i << " " << pair.j << " image " << pair.image[0];
}

/// visit_close_pairs() against all pairs, among particles of which some are marked.
template <int D>
void expect_visited(const Box<D>& box, const std::vector<Vec<D>>& x, const std::vector<double>& reach) {
  std::vector<char> without(x.size()), fixed(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) without[i] = i % 5 == 1, fixed[i] = i % 3 == 0;
  std::set<NeighbourPair<D>> visited;
  visit_close_pairs<D>(box, x, reach, without, fixed, [&](Id i, Id j, Image<D> image) {
    EXPECT_FALSE(j >= i || without[i] || (fixed[i] && fixed[j]));
    for (std::int32_t& k : image) k = -k;  // as seen from the other particle
    EXPECT_TRUE(visited.insert({j, i, image}).second) << "a pair is visited twice";
  });
  for (const auto& pair : brute_force<D>(box, x, reach))
    if (!without[pair.j] && !(fixed[pair.i] && fixed[pair.j])) {
      EXPECT_TRUE(visited.contains(pair)) << pair.i << " " << pair.j;
    }
}

template <int D>
void walk(Boundary boundary, double edge, double reach) {
  Box<D> box;
  box.edges = Vec<D>::Constant(edge);
  box.boundary.fill(boundary);
  box.boundary[0] = Boundary::periodic;
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> uniform(0, edge), step(-0.06, 0.06);
  std::vector<Vec<D>> x(60);
  std::vector<Image<D>> image(x.size());
  for (auto& p : x)
    for (int k = 0; k < D; ++k) p[k] = uniform(random);
  NeighbourList<D> list(box, std::vector<double>(x.size(), reach / 2));
  int calls = 0;
  for (; calls < 60; ++calls) {
    auto moved = x;
    for (auto& p : moved)
      for (int k = 0; k < D; ++k) p[k] += step(random);
    const auto pairs = list.cover(x, moved);
    expect_covered<D>(box, x, std::vector<double>(x.size(), reach / 2), pairs);
    if (calls % 20 == 0) {
      std::vector<double> unequal(x.size());
      for (std::size_t i = 0; i < x.size(); ++i) unequal[i] = reach / 2 / static_cast<double>(1 + i % 4);
      expect_visited<D>(box, x, unequal);
    }
    // At the end of the step positions are not wrapped yet: the list's images are those at the start.
    std::set<NeighbourPair<D>> listed(pairs.begin(), pairs.end());
    for (const auto& pair : brute_force<D>(box, moved, std::vector<double>(x.size(), reach / 2)))
      EXPECT_TRUE(listed.contains(pair));
    x = moved;
    for (std::size_t i = 0; i < x.size(); ++i) box.wrap(x[i], image[i]);
  }
  EXPECT_GT(list.rebuilds(), 1u);
  EXPECT_LT(list.rebuilds(), 60u);
}

TEST(NeighbourList, CoversAllPairsWhileParticlesMoveAndAreWrapped) {
  walk<2>(Boundary::periodic, 6, 1.0);
  walk<2>(Boundary::wall, 6, 1.0);
  walk<3>(Boundary::periodic, 4, 1.0);
  walk<3>(Boundary::open, 4, 1.0);
}

TEST(NeighbourList, SeesSeveralImagesOfOnePairInASmallBox) {
  walk<2>(Boundary::periodic, 1.5, 1.4);
  walk<3>(Boundary::periodic, 1.5, 1.4);
}

TEST(NeighbourList, LastsSomeCallsWhereEachMovesParticlesFar) {
  Box<2> box;
  box.edges = Vec<2>::Constant(12);
  box.boundary.fill(Boundary::periodic);
  const std::vector<double> reach(100, 0.5);
  std::vector<Vec<2>> x, v;
  for (int k = 0; k < 100; ++k) {
    x.push_back({1.2 * (k % 10), 1.2 * (k / 10)});
    v.push_back({0.1 * std::cos(k), 0.1 * std::sin(k)});  // a list of positions alone lasts for 0.075
  }
  NeighbourList<2> list(box, reach);
  for (int call = 0; call < 30; ++call) {
    expect_covered<2>(box, x, reach, list.cover(x));
    for (std::size_t i = 0; i < x.size(); ++i) x[i] += v[i];
  }
  EXPECT_LT(list.rebuilds(), 15u);
}

TEST(NeighbourList, RefusesWildStepsBeforeTheyFillTheMemory) {
  Box<2> box;
  box.edges = {60, 60};
  box.boundary.fill(Boundary::periodic);
  std::vector<Vec<2>> x;
  for (int k = 0; k < 3600; ++k) x.emplace_back(k % 60, k / 60);
  NeighbourList<2> list(box, std::vector<double>(x.size(), 0.5));
  const auto pairs = list.cover(x);
  const std::vector before(pairs.begin(), pairs.end());
  EXPECT_THROW(list.cover(x, 100.0), Error);  // 3600 particles, each with 35 images around
  EXPECT_TRUE(std::ranges::equal(list.cover(x), before));
}

TEST(NeighbourList, RecoversFromOneWildStep) {
  Box<2> box;
  box.edges = {2, 2};
  box.boundary.fill(Boundary::periodic);
  const std::vector<Vec<2>> x = {{0.2, 0.2}, {1, 1}, {1.7, 0.4}};
  auto wild = x, tame = x;
  wild[0][0] += 7;
  tame[0][0] += 1e-4;
  NeighbourList<2> list(box, {0.1, 0.1, 0.1});
  const auto before = list.cover(x, tame).size();
  EXPECT_GT(list.cover(x, wild).size(), 10 * before + 10);
  EXPECT_EQ(list.cover(x, tame).size(), before);
  wild[0][0] += 30;
  EXPECT_THROW(list.cover(x, wild), Error);
  wild[0][0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(NeighbourList<2>(box, {0.1, 0.1, 0.1}).cover(wild), Error);
  EXPECT_THROW(visit_close_pairs<2>(box, wild, std::vector<double>(3, 0.1), {}, {}, [](Id, Id, auto&) {}), Error);
}

template <int D>
void list_unequal(Boundary boundary) {
  Box<D> box;
  box.edges = Vec<D>::Constant(14);
  box.boundary.fill(boundary);
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> uniform(0, 14), octave(-4, 1);
  std::vector<Vec<D>> x(90);
  std::vector<double> reach;
  for (auto& p : x) {
    for (int k = 0; k < D; ++k) p[k] = uniform(random);
    reach.push_back(1.5 * std::exp2(octave(random)));
  }
  NeighbourList<D> list(box, reach);
  const auto pairs = list.cover(x);
  expect_covered<D>(box, x, reach, pairs);
  for (const auto& pair : pairs)  // and no more pairs than the skin requires
    EXPECT_LT((x[pair.i] - x[pair.j] + box.shift(pair.image)).norm(), reach[pair.i] + reach[pair.j] + 1);
}

TEST(NeighbourList, CoversParticlesOfVeryDifferentSizes) {
  for (const Boundary boundary : {Boundary::periodic, Boundary::wall, Boundary::open}) {
    list_unequal<2>(boundary);
    list_unequal<3>(boundary);
  }
}

}  // namespace
}  // namespace carom::neighbour_list_test
