// SPDX-License-Identifier: BSD-3-Clause
#include "engine/setup/placement.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <numeric>

#include "engine/base/random.h"

namespace carom::placement_test {
namespace {

template <int D>
Box<D> box_of(const Vec<D>& edges, Boundary boundary) {
  Box<D> box;
  box.edges = edges;
  box.boundary.fill(boundary);
  return box;
}

/// The smallest distance between two of the points, images included, by brute force.
template <int D>
double smallest_distance(const Box<D>& box, const std::vector<Vec<D>>& x) {
  double smallest = box.edges.minCoeff();
  for (std::size_t i = 0; i < x.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const Vec<D> d = x[i] - x[j];
      smallest = std::min(smallest, (d + box.shift(box.nearest_image(d))).norm());
    }
  return smallest;
}

TEST(Lattice, FccInItsCubeIsPerfect) {
  const auto box = box_of<3>(Vec<3>::Constant(6), Boundary::periodic);
  const auto sites = lattice_sites(Lattice::centred, box, 108, 0.5);  // 4·3³
  ASSERT_EQ(sites.size(), 108u);
  EXPECT_NEAR(smallest_distance(box, sites), 2 / std::numbers::sqrt2, 1e-14);
}

TEST(Lattice, HexagonalInItsBoxIsPerfect) {
  const double area = 1024 * std::numbers::sqrt3 / 2;  // of cells with neighbour distance 1
  const auto box = box_of<2>(commensurate_edges<2>(Lattice::centred, 1024, area), Boundary::periodic);
  EXPECT_NEAR(box.volume(), area, 1e-10);
  const auto sites = lattice_sites(Lattice::centred, box, 1024, 0.5);
  ASSERT_EQ(sites.size(), 1024u);
  EXPECT_GT(smallest_distance(box, sites), 0.95);  // less than 1 because whole cells must fit the box
}

TEST(Lattice, SimpleLatticesFillSquareAndCube) {
  const auto square = box_of<2>(Vec<2>::Constant(5), Boundary::periodic);
  EXPECT_NEAR(smallest_distance(square, lattice_sites(Lattice::simple, square, 25, 0.5)), 1, 1e-14);
  const auto cube = box_of<3>(Vec<3>::Constant(4), Boundary::periodic);
  EXPECT_NEAR(smallest_distance(cube, lattice_sites(Lattice::simple, cube, 64, 0.5)), 1, 1e-14);
}

TEST(Lattice, LongBoxesGetMoreCellsAlongTheirLength) {
  const auto box = box_of<3>({40, 4, 4}, Boundary::periodic);
  const auto fit = fit_lattice(Lattice::simple, box, 640, 0.5);
  EXPECT_EQ(fit.cells, (std::array<int, 3>{40, 4, 4}));
}

TEST(Lattice, StaysOffWallsByTheMargin) {
  const auto box = box_of<3>(Vec<3>::Constant(5), Boundary::wall);
  const auto sites = lattice_sites(Lattice::centred, box, 108, 0.5);
  const std::vector<double> radius(sites.size(), 0.5);
  EXPECT_EQ(find_outsiders<3>(box, sites, radius).spheres, 0u);
  EXPECT_EQ(sites.front(), Vec<3>::Constant(0.5));
}

TEST(Distribute, GivesEachGroupItsShareAndDependsOnTheSeed) {
  const std::vector<std::size_t> counts{30, 50};
  const auto owner = distribute(100, counts, 1);
  EXPECT_EQ(std::count(owner.begin(), owner.end(), 0), 30);
  EXPECT_EQ(std::count(owner.begin(), owner.end(), 1), 50);
  EXPECT_EQ(std::count(owner.begin(), owner.end(), -1), 20);
  EXPECT_EQ(owner, distribute(100, counts, 1));
  EXPECT_NE(owner, distribute(100, counts, 2));
}

TEST(RandomInsertion, PlacesUnequalSpheresWithoutOverlap) {
  for (const Boundary boundary : {Boundary::wall, Boundary::periodic}) {
    const auto box = box_of<2>(Vec<2>::Constant(12), boundary);
    std::vector<double> radius(100, 0.3);
    std::fill_n(radius.begin() + 50, 20, 0.8);
    std::vector<Vec<2>> x(radius.size(), Vec<2>::Constant(6));  // the first one is there already
    std::vector<Id> ids(radius.size() - 1);
    std::iota(ids.begin(), ids.end(), 1);
    ASSERT_EQ(insert_at_random<2>(box, x, radius, ids, 5), ids.size());
    EXPECT_EQ(x[0], Vec<2>::Constant(6));
    EXPECT_EQ(find_overlaps<2>(box, x, radius).pairs, 0u);
    EXPECT_EQ(find_outsiders<2>(box, x, radius).spheres, 0u);
  }
}

TEST(RandomInsertion, PlacesSpheresOfTenToOneInThreeDimensions) {
  std::vector<double> radius(600, 0.1);
  for (std::size_t i = 0; i < radius.size(); i += 60) radius[i] = 1.0;
  for (std::size_t i = 5; i < radius.size(); i += 20) radius[i] = 0.35;
  const auto box = box_of<3>({5, 6, 7}, Boundary::periodic);
  std::vector<Vec<3>> x(radius.size());
  std::vector<Id> ids(radius.size());
  std::iota(ids.begin(), ids.end(), 0);
  ASSERT_EQ(insert_at_random<3>(box, x, radius, ids, 5), ids.size());
  for (std::size_t i = 0; i < x.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      Vec<3> d = x[i] - x[j];
      d += box.shift(box.nearest_image(d));
      ASSERT_GE(d.norm(), radius[i] + radius[j]) << i << " and " << j;
    }
}

TEST(RandomInsertion, TellsHowFarItCame) {
  const auto box = box_of<2>(Vec<2>::Constant(5), Boundary::periodic);
  const std::vector<double> radius(30, 0.5);  // packing fraction 0.94
  std::vector<Vec<2>> x(radius.size());
  std::vector<Id> ids(radius.size());
  std::iota(ids.begin(), ids.end(), 0);
  const std::size_t placed = insert_at_random<2>(box, x, radius, ids, 5, {}, 2000);
  EXPECT_GT(placed, 10u);
  EXPECT_LT(placed, 21u);  // at most 0.547 of the box, except for the finite size
}

TEST(Overlaps, AgreeWithAllPairsInEveryKindOfBox) {
  for (const Boundary boundary : {Boundary::periodic, Boundary::wall, Boundary::open})
    for (const double edge : {1.5, 3.0, 9.0}) {
      const auto box = box_of<3>(Vec<3>::Constant(edge), boundary);
      std::vector<Vec<3>> x;
      std::vector<double> radius;
      RandomStream random(1, RandomPurpose::probe, 0);
      for (int i = 0; i < 200; ++i) {  // some of them outside
        const Vec<3> fraction{random.uniform(), random.uniform(), random.uniform()};
        x.push_back((1.4 * fraction - Vec<3>::Constant(0.2)) * edge);
        radius.push_back(i % 9 == 0 ? 0.07 : 0.2 + 0.1 * (i % 6));  // up to ten to one
      }
      std::size_t pairs = 0;
      double worst = 1;
      for (std::size_t i = 0; i < x.size(); ++i)
        for (std::size_t j = 0; j < i; ++j) {
          const Vec<3> d = x[i] - x[j];
          const Image<3> nearest = box.nearest_image(d);
          for (int k = 0; k < 27; ++k) {
            Image<3> image = nearest;
            for (int axis = 0, rest = k; axis < 3; ++axis, rest /= 3)
              image[axis] += box.periodic(axis) ? rest % 3 - 1 : 0;
            if (boundary != Boundary::periodic && k > 0) continue;
            const double relative = (d + box.shift(image)).norm() / (radius[i] + radius[j]);
            if (relative < 1) ++pairs;
            worst = std::min(worst, relative);
          }
        }
      const Overlaps found = find_overlaps<3>(box, x, radius);
      ASSERT_GT(pairs, 0u);
      EXPECT_EQ(found.pairs, pairs) << "boundary " << static_cast<int>(boundary) << ", edge " << edge;
      EXPECT_NEAR(found.distance / found.contact, worst, 1e-14);
    }
}

TEST(Overlaps, TouchingSpheresAndWallsAreAllowed) {
  const auto box = box_of<2>({10, 1}, Boundary::wall);
  const std::vector<double> radius{0.5, 0.5, 0.5};
  const std::vector<Vec<2>> x{{0.5, 0.5}, {1.5, 0.5}, {2.5 - 5e-14, 0.5}};
  EXPECT_EQ(find_overlaps<2>(box, x, radius).pairs, 0u);
  EXPECT_EQ(find_outsiders<2>(box, x, radius).spheres, 0u);
  const std::vector<Vec<2>> deeper{{0.5 - 1e-12, 0.5}, {1.5, 0.5}, {2.5 - 1e-12, 0.5}};
  EXPECT_EQ(find_overlaps<2>(box, deeper, radius).pairs, 1u);
  EXPECT_EQ(find_outsiders<2>(box, deeper, radius).spheres, 1u);
}

TEST(Velocities, HaveTheTemperatureAskedForAndNoMomentum) {
  constexpr std::size_t n = 500;
  Particles<3> p;
  p.v.assign(n, Vec<3>::Zero());
  for (std::size_t i = 0; i < n; ++i) p.mass.push_back(i % 2 == 0 ? 1 : 7.5);
  std::vector<Id> ids(n);
  std::iota(ids.begin(), ids.end(), 0);
  const std::vector<double> temperature(n, 1.7);
  draw_velocities<3>(p, ids, temperature, 11);
  double twice_kinetic = 0, light = 0;
  Vec<3> momentum = Vec<3>::Zero();
  for (std::size_t i = 0; i < n; ++i) {
    twice_kinetic += p.mass[i] * p.v[i].squaredNorm();
    if (i % 2 == 0) light += p.mass[i] * p.v[i].squaredNorm();
    momentum += p.mass[i] * p.v[i];
  }
  EXPECT_NEAR(twice_kinetic / (3.0 * n), 1.7, 1e-13);
  EXPECT_LT(momentum.norm(), 1e-11);
  EXPECT_NEAR(light / (3.0 * n / 2), 1.7,
              5 * 1.7 * std::sqrt(2 / (1.5 * n)));  // equipartition, five standard deviations

  Particles<3> again = p, other = p;
  draw_velocities<3>(again, ids, temperature, 11);
  draw_velocities<3>(other, ids, temperature, 12);
  EXPECT_EQ(again.v, p.v);
  EXPECT_NE(other.v, p.v);
}

TEST(Velocities, SingleParticleKeepsItsMomentum) {
  Particles<2> p;
  p.v.assign(1, Vec<2>::Zero());
  p.mass = {4};
  const std::vector<Id> ids{0};
  const std::vector<double> temperature{2};
  draw_velocities<2>(p, ids, temperature, 1);
  EXPECT_NEAR(4 * p.v[0].squaredNorm(), 2 * 2, 1e-14);
}

/// Exact in sum, alike for light and heavy, and by id: a second species does not change the numbers before the scaling.
TEST(Spins, HaveTheRotationalTemperatureAskedFor) {
  constexpr std::size_t n = 600;
  ContactLaws laws;
  laws.inertias = {0.4, 0.6};
  Particles<3> p;
  p.spin.assign(n, Vec<3>(1, 2, 3));
  std::vector<Id> ids;
  for (std::size_t i = 0; i < n; ++i) {
    p.mass.push_back(i % 2 == 0 ? 1 : 7.5), p.radius.push_back(i % 2 == 0 ? 0.5 : 2), p.species.push_back(i % 2);
    if (i > 0) ids.push_back(static_cast<Id>(i));
  }
  const std::vector<double> temperature(ids.size(), 1.7);
  draw_spins<3>(p, laws, ids, temperature, 11);
  EXPECT_EQ(p.spin[0], Vec<3>(1, 2, 3));
  std::array<double, 2> twice_rotational{};
  for (const Id i : ids) twice_rotational[i % 2] += (i % 2 == 0 ? 0.4 * 0.25 : 0.6 * 7.5 * 4) * p.spin[i].squaredNorm();
  EXPECT_NEAR((twice_rotational[0] + twice_rotational[1]) / (3.0 * (n - 1)), 1.7, 1e-13);
  EXPECT_NEAR(twice_rotational[0] / (1.5 * n), 1.7, 5 * 1.7 * std::sqrt(2 / (1.5 * n)));  // five standard deviations

  Particles<3> again = p, other = p;
  draw_spins<3>(again, laws, ids, temperature, 11);
  draw_spins<3>(other, laws, ids, temperature, 12);
  EXPECT_EQ(again.spin, p.spin);
  EXPECT_NE(other.spin, p.spin);
  Particles<3> one = p;
  draw_spins<3>(one, laws, std::vector<Id>{7}, std::vector<double>{1.7}, 11);
  EXPECT_NEAR((one.spin[7].normalized() - p.spin[7].normalized()).norm(), 0, 1e-14);

  Particles<2> disc;
  disc.mass = {2}, disc.radius = {3}, disc.species = {0}, disc.spin = {Spin<2>::Zero()};
  draw_spins<2>(disc, {}, std::vector<Id>{0}, std::vector<double>{0.7}, 11);
  EXPECT_NEAR(0.5 * 2 * 9 * disc.spin[0].squaredNorm(), 0.7, 1e-15);
}

TEST(PackingFraction, IsVolumeOfSpheresOverVolume) {
  const std::vector<double> radius{1, 2};
  EXPECT_DOUBLE_EQ(packing_fraction<2>(50, radius), std::numbers::pi * 5 / 50);
  EXPECT_DOUBLE_EQ(packing_fraction<3>(50, radius), 4 * std::numbers::pi / 3 * 9 / 50);
}

}  // namespace
}  // namespace carom::placement_test
