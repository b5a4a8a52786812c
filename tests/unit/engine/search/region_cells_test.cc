// SPDX-License-Identifier: BSD-3-Clause
// The neighbours that cells find agree with a search through all spheres in all images.

#include "engine/search/region_cells.h"

#include <gtest/gtest.h>

#include <random>
#include <set>
#include <tuple>

namespace carom::region_cells_test {
namespace {

constexpr double kReach = 1.2;

template <int D>
struct Centres {
  Centres(const Box<D>& box_, std::size_t n, unsigned seed)
      : box(box_),
        packing(n, n),
        x(n),
        boxes(n),
        cells(box, packing, widest_kernels<ScanKernels>(), extent(n), double(n), 1, kReach) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(0, 1);
    for (std::size_t i = 0; i < n; ++i)
      for (int k = 0; k < D; ++k) {
        const double at = uniform(random);
        x[i][k] = i % 3 == 0 ? 0.3 * at : at * box.edges[k];  // a third is in a corner: more than a line holds
        if (box.periodic(k)) x[i][k] += box.edges[k] * (static_cast<int>(random() % 3) - 1);
      }
  }
  Extent<D> extent(std::size_t n) const {
    Extent<D> all;
    all.particles = n;
    all.high = box.edges;
    return all;
  }
  bool insert(Slot i) {
    Image<D> image;
    if (!cells.insert(i, x[i], image)) return false;
    boxes[i] = packing.linear(image);
    return inside.insert(i).second;
  }
  void remove(Slot i) {
    cells.remove(i, x[i]);
    inside.erase(i);
  }
  void expect_found(const Vec<D>& at) {
    const auto found = cells.find(at, kReach);
    std::set<std::uint32_t> candidates;
    for (std::size_t q = 0; q < found.slots.size(); ++q) {
      const Slot j = found.slots[q];
      const std::uint32_t candidate = packing.pack(j, boxes[j] - found.away[q] - found.boxes);
      EXPECT_TRUE(candidates.insert(candidate).second) << "found twice: " << j;
      EXPECT_TRUE(inside.contains(j)) << j;
      EXPECT_LT((at - x[j] + box.shift(packing.image(candidate))).norm(), kReach + 0.05) << j;
    }
    for (const Slot j : inside)
      for (int code = 0; code < std::pow(7, D); ++code) {
        Image<D> image;
        bool there = true;
        for (int k = 0, digits = code; k < D; ++k, digits /= 7) {
          image[k] = digits % 7 - 3;
          there = there && (image[k] == 0 || box.periodic(k));
        }
        if (!there || (at - x[j] + box.shift(image)).norm() > kReach) continue;
        EXPECT_TRUE(candidates.contains(packing.pack(j, packing.linear(image)))) << j;
        ++expected;
      }
  }

  Box<D> box;
  Packing<D> packing;
  std::vector<Vec<D>> x;
  std::vector<std::int32_t> boxes;
  RegionCells<D> cells;
  std::set<Slot> inside;
  std::size_t expected = 0;
};

template <int D>
void expect_found_as_they_come_and_go(const Box<D>& box, unsigned seed) {
  Centres<D> c(box, 120, seed);
  c.cells.clear();
  for (const unsigned period : {1, 4, 3, 2, 1}) {  // the first time all come
    for (Slot i = 0; i < c.x.size(); ++i) {
      if (i % period != 0) continue;
      if (c.inside.contains(i))
        c.remove(i);
      else
        EXPECT_TRUE(c.insert(i));
    }
    for (Slot i = 0; i < c.x.size(); i += 3) c.expect_found(c.x[i]);
  }
  EXPECT_GT(c.expected, 1000u);
}

constexpr Boundary W = Boundary::wall, P = Boundary::periodic, O = Boundary::open;

TEST(RegionCells, FindSpheresThatComeAndGo) {
  expect_found_as_they_come_and_go<2>({{9, 7}, {P, P}}, 1);
  expect_found_as_they_come_and_go<2>({{9, 1.5}, {W, P}}, 2);
  expect_found_as_they_come_and_go<3>({{5, 6, 4}, {P, P, P}}, 3);
  expect_found_as_they_come_and_go<3>({{5, 1.3, 4}, {O, P, W}}, 4);
}

TEST(RegionCells, FindSpheresInATiltedLattice) {
  for (const double tilt : {0.01, 2.3, 4.6}) {
    expect_found_as_they_come_and_go<2>({.edges = {9, 7}, .boundary = {P, P}, .tilt = tilt}, 1);
    expect_found_as_they_come_and_go<2>({.edges = {5, 1.5}, .boundary = {P, P}, .tilt = tilt}, 2);
    expect_found_as_they_come_and_go<3>({.edges = {5, 6, 4}, .boundary = {P, P, P}, .tilt = tilt}, 3);
    expect_found_as_they_come_and_go<3>({.edges = {5, 1.3, 4}, .boundary = {P, P, W}, .tilt = tilt}, 4);
  }
}

TEST(RegionCells, SeeAsFarAfterTheyHaveBeenEmptied) {
  Centres<2> c({.edges = {5, 9}, .boundary = {P, P}, .tilt = 12}, 50, 1);
  c.cells.clear();
  const auto widest = c.cells.widest();
  EXPECT_EQ(widest, 1 + 3);  // the next box along y, and its displacement
  c.cells.clear();
  EXPECT_EQ(c.cells.widest(), widest);
}

TEST(RegionCells, AreStoredAroundGivenPlacesOnly) {
  Centres<3> c({{30, 30, 4}, {P, W, P}}, 300, 5);
  c.cells.confine(std::vector<Vec<3>>{{1, 1, 1}, {2, 2, 3}});
  c.cells.clear();
  std::vector<Slot> beyond;
  for (Slot i = 0; i < c.x.size(); ++i)
    if (!c.insert(i)) beyond.push_back(i);
  EXPECT_GT(c.inside.size(), 100u);
  ASSERT_GT(beyond.size(), 100u);
  c.expect_found({0.5, 0.5, 0.5});
  const std::vector<Slot> members = c.cells.spread();
  EXPECT_EQ(std::set<Slot>(members.begin(), members.end()), std::exchange(c.inside, {}));
  for (Slot i = 0; i < c.x.size(); ++i) EXPECT_TRUE(c.insert(i));
  for (const Slot i : beyond) c.expect_found(c.x[i]);
  EXPECT_GT(c.expected, 200u);
}

/// A grid that leaves out one row would need a row for what is left out, so it stores all rows in their order.
TEST(CellGrid, StoresFewerRowsOrAllOfThemInOrder) {
  Box<3> box;
  box.edges.setConstant(10);
  box.boundary.fill(Boundary::periodic);
  Extent<3> extent(1000, Vec<3>::Zero(), box.edges);
  for (const int covered : {7, 8, 9, 10}) {
    CellGrid<3> grid(box, 0.99, extent, 8);
    ASSERT_EQ(grid.count(0), 10);
    std::vector<Vec<3>> places(covered);
    for (int c = 0; c < covered; ++c) places[c].setConstant(9.5 - c);
    grid.confine(places, 0, 2);
    for (const int axis : {0, 1}) {
      EXPECT_EQ(grid.rows(axis), covered < 9 ? covered + 1 : 10) << covered;
      for (int c = 0; grid.rows(axis) == 10 && c < 10; ++c) EXPECT_EQ(grid.row(axis, c), c) << covered;
    }
  }
}

/// The cells within a range, each as often as it has images there, and of two cells each only once if halved.
TEST(CellGrid, RangesCoverAllCellsAroundOnce) {
  Box<3> box;
  box.edges = {4, 3, 2};
  box.boundary = {Boundary::wall, Boundary::periodic, Boundary::periodic};
  const CellGrid<3> grid(box, 0.99, {1000, Vec<3>::Zero(), box.edges}, 2, 3);
  ASSERT_EQ((Cell<3>{grid.count(0), grid.count(1), grid.count(2)}), (Cell<3>{4, 3, 6}));
  const Cell<3> range = grid.range(1.6);
  EXPECT_EQ(range, (Cell<3>{2, 2, 5}));
  Cell<3> centre{};
  for (std::size_t at = 0; at < grid.cells(); ++at, grid.advance(centre)) {
    ASSERT_EQ(grid.index(centre), at);
    std::multiset<std::pair<std::size_t, Image<3>>> all, half, found, found_half;
    for (std::int32_t a = std::max(0, centre[0] - 2); a <= std::min(3, centre[0] + 2); ++a)
      for (std::int32_t b = centre[1] - 2; b <= centre[1] + 2; ++b)
        for (std::int32_t c = centre[2] - 5; c <= centre[2] + 5; ++c) {
          const Cell<3> cell{a, b, c};
          all.insert({grid.index(cell), grid.boxes(cell)});
          if (cell >= centre) half.insert({grid.index(cell), grid.boxes(cell)});
        }
    for (const bool halved : {false, true})
      grid.for_each_range(centre, range, halved, [&](std::size_t first, std::size_t end, const Image<3>& boxes) {
        auto& to = halved ? found_half : found;
        EXPECT_TRUE(!halved || !to.empty() || first == at);
        for (; first < end; ++first) to.insert({first, boxes});
      });
    EXPECT_EQ(found, all);
    EXPECT_EQ(found_half, half);
  }
  EXPECT_EQ(centre, Cell<3>{});
}

/// In a tilted lattice the pairs of points within reach are in cells that a range visits, and with halved ranges each
/// pair is visited once.
template <int D>
void expect_pairs_once(const Vec<D>& edges, double tilt) {
  Box<D> box;
  box.edges = edges;
  box.boundary.fill(P);
  box.tilt = tilt;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1, 2);
  std::vector<Vec<D>> x(60);
  for (Vec<D>& each : x)
    for (int k = 0; k < D; ++k) each[k] = uniform(random) * edges[k];
  const CellGrid<D> grid(box, 0.9, {x.size(), Vec<D>::Zero(), box.edges});
  using Pair = std::tuple<std::size_t, std::size_t, Image<D>>;
  std::multiset<Pair> all, found, found_half;
  for (std::size_t i = 0; i < x.size(); ++i)
    for (std::size_t j = 0; j < x.size(); ++j)
      for (int code = 0; code < std::pow(9, D); ++code) {
        Image<D> image;
        for (int k = 0, digits = code; k < D; ++k, digits /= 9) image[k] = digits % 9 - 4;
        image[0] -= static_cast<int>(std::nearbyint(image[1] * tilt / edges[0]));  // where the images of a row are
        if ((i != j || image != Image<D>{}) && (x[i] - x[j] + box.shift(image)).norm() < 0.9) all.insert({i, j, image});
      }
  for (std::size_t i = 0; i < x.size(); ++i)
    for (const bool half : {false, true})
      grid.for_each_range(grid.cell(x[i]), grid.range(0.9), half,
                          [&](std::size_t first, std::size_t end, const Image<D>& boxes) {
                            for (std::size_t j = 0; j < x.size(); ++j) {
                              const Cell<D> cell = grid.cell(x[j]);
                              if (grid.index(cell) < first || grid.index(cell) >= end) continue;
                              Image<D> image = grid.boxes(cell);
                              for (int k = 0; k < D; ++k) image[k] -= boxes[k];
                              if (!((x[i] - x[j] + box.shift(image)).norm() < 0.9)) continue;
                              const Cell<D> centre = grid.cell(x[i]);
                              const bool own = grid.index(cell) == grid.index(centre) && boxes == grid.boxes(centre);
                              if (i == j && image == Image<D>{}) continue;
                              if (!half) found.insert({i, j, image});
                              if (half && (!own || i < j)) found_half.insert({i, j, image});
                            }
                          });
  EXPECT_EQ(found, all);
  std::multiset<Pair> both = found_half;
  for (auto [i, j, image] : found_half) {
    for (auto& k : image) k = -k;
    both.insert({j, i, image});
  }
  EXPECT_EQ(both, all);
  EXPECT_GT(all.size(), 100u);
}

TEST(CellGrid, FindsPairsInATiltedLatticeOnce) {
  for (const double tilt : {0.3, 1.7, 2.9}) {
    expect_pairs_once<2>({3, 4}, tilt);
    expect_pairs_once<2>({5, 1}, tilt);
    expect_pairs_once<3>({3, 3, 2}, tilt);
  }
}

}  // namespace
}  // namespace carom::region_cells_test
