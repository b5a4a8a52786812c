// SPDX-License-Identifier: BSD-3-Clause
// Reactions of resting contacts: closed forms, brute force over all sets of contacts, and what the stretch conserves.

#include "engine/stepping/resting.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "engine/base/random.h"

namespace carom::resting_test {
namespace {

template <int D>
using Contacts = std::vector<RestingContact<D>>;
template <int D>
using Motion = std::vector<Vec<D>>;

constexpr Id kFloor2 = 2, kFloor3 = 4;  // numbers of the lower walls of the last axis

template <int D>
RestingContact<D> pair(Id lo, Id hi, const Vec<D>& normal, double bound = 0) {
  return {.key = {.lo = lo, .hi = hi}, .normal = normal, .bound = bound};
}
template <int D>
RestingContact<D> at_wall(Id i, Id wall) {
  return {.key = {.kind = EventKind::wall, .lo = i, .hi = wall},
          .normal = (wall % 2 == 0 ? 1.0 : -1.0) * Vec<D>::Unit(static_cast<int>(wall / 2))};
}

/// A column of bodies with these masses on the floor; the lowest is first.
Contacts<2> column(std::size_t n) {
  Contacts<2> contacts;
  for (Id k = 1; k < n; ++k) contacts.push_back(pair<2>(k - 1, k, {0, -1}));
  contacts.push_back(at_wall<2>(0, kFloor2));
  return contacts;
}

template <int D>
double kinetic(const std::vector<double>& mass, const Motion<D>& v) {
  double sum = 0;
  for (Id i = 0; i < v.size(); ++i) sum += 0.5 * mass[i] * v[i].squaredNorm();
  return sum;
}
template <int D>
Vec<D> momentum(const std::vector<double>& mass, const Motion<D>& v) {
  Vec<D> sum = Vec<D>::Zero();
  for (Id i = 0; i < v.size(); ++i) sum += mass[i] * v[i];
  return sum;
}
template <int D>
double largest(const Motion<D>& w) {
  double most = 0;
  for (const auto& each : w) most = std::max(most, each.cwiseAbs().maxCoeff());
  return most;
}
template <int D>
double opening(const RestingContact<D>& contact, const Motion<D>& w) {
  const Vec<D> relative =
      contact.key.kind == EventKind::pair ? Vec<D>(w[contact.key.lo] - w[contact.key.hi]) : w[contact.key.lo];
  return contact.normal.dot(relative);
}

TEST(SolveReactions, AColumnBearsTheWeightAboveEachContact) {
  for (const std::size_t n : {1u, 2u, 7u, 40u}) {
    auto contacts = column(n);
    std::vector<double> mass(n);
    for (Id k = 0; k < n; ++k) mass[k] = 1 + 0.1 * static_cast<double>(k);
    Motion<2> w(n, {0.25, -1.0});
    ASSERT_TRUE(solve_reactions<2>(contacts, mass, w));
    const double weight = std::accumulate(mass.begin(), mass.end(), 0.0);
    double above = 0;
    for (Id k = static_cast<Id>(n); k-- > 0;) {
      above += mass[k];
      EXPECT_NEAR((k > 0 ? contacts[k - 1] : contacts.back()).lambda, above, 1e-12 * above) << k << " of " << n;
      EXPECT_EQ(w[k][0], 0.25);
      EXPECT_NEAR(w[k][1], 0, 1e-14 * weight) << k << " of " << n;
    }
  }
}

TEST(SolveReactions, MassRatiosOfAMillion) {
  for (const std::vector<double>& mass :
       {std::vector<double>{1, 1e6}, {1e6, 1}, {1, 1e6, 1, 1e6}, {1e-3, 1e3, 1e-3, 1}}) {
    auto contacts = column(mass.size());
    Motion<2> w(mass.size(), {0, -1.0});
    ASSERT_TRUE(solve_reactions<2>(contacts, mass, w));
    double above = 0;
    for (Id k = static_cast<Id>(mass.size()); k-- > 0;) {
      above += mass[k];
      // Forces on a light body have the rounding errors of the weight above it: a condition number of 1e6 and more.
      EXPECT_NEAR((k > 0 ? contacts[k - 1] : contacts.back()).lambda / above, 1, 1e-9) << k;
      EXPECT_NEAR(w[k][1], 0, 1e-9) << k;
    }
  }
}

TEST(SolveReactions, AContactThatIsDrawnApartOpens) {
  // 0 is pressed on the floor, 1 is pulled off it; 3 is pressed on 2, and both fall freely.
  Contacts<2> contacts = {pair<2>(0, 1, {0, -1}), pair<2>(2, 3, {0, -1}), at_wall<2>(0, kFloor2)};
  const std::vector<double> mass = {1, 2, 3, 1};
  Motion<2> w = {{0.5, -1}, {0.25, 0.125}, {0, -1}, {0, -3}};
  ASSERT_TRUE(solve_reactions<2>(contacts, mass, w));
  EXPECT_EQ(contacts[0].lambda, 0);
  EXPECT_EQ(w[1], Vec<2>(0.25, 0.125));
  EXPECT_NEAR(contacts[2].lambda, 1, 1e-14);
  EXPECT_NEAR(contacts[1].lambda, 1.5, 1e-14);
  EXPECT_NEAR(w[2][1], -1.5, 1e-14);
  EXPECT_NEAR(w[3][1], -1.5, 1e-14);
  EXPECT_EQ(w[0][0], 0.5);
}

TEST(SolveReactions, ALeverThatLiftsOneOfItsContacts) {
  // The contact 0–1 is pressed at first and opens once 1–2 is held: the heavy 2 drives 1 away faster than 0 follows.
  Contacts<2> contacts = {pair<2>(0, 1, {-1, 0}), pair<2>(1, 2, {1, 0})};
  const std::vector<double> mass = {1, 1, 10};
  Motion<2> w = {{2, 0}, {1, 0}, {4, 0}};
  ASSERT_TRUE(solve_reactions<2>(contacts, mass, w));
  EXPECT_EQ(contacts[0].lambda, 0);
  EXPECT_NEAR(contacts[1].lambda, 30.0 / 11, 1e-13);
  EXPECT_EQ(w[0], Vec<2>(2, 0));
  EXPECT_NEAR(w[1][0], 41.0 / 11, 1e-13);
}

TEST(SolveReactions, TheBoundIsReached) {
  Contacts<2> contacts = {pair<2>(0, 1, {0, -2}, 0.5)};
  const std::vector<double> mass = {1, 4};
  Motion<2> w = {{0, 0}, {0, 0.125}};
  ASSERT_TRUE(solve_reactions<2>(contacts, mass, w));
  EXPECT_NEAR(opening(contacts[0], w), 0.5, 1e-15);
  EXPECT_NEAR(contacts[0].lambda, 0.25 / (4 * 1.25), 1e-15);
  contacts[0].bound = -3;
  contacts[0].lambda = 0;
  w = {{0, 0}, {0, -1}};
  ASSERT_TRUE(solve_reactions<2>(contacts, mass, w));
  EXPECT_EQ(contacts[0].lambda, 0);
}

TEST(SolveReactions, TellsTheEnergyLost) {
  auto contacts = column(3);
  const std::vector<double> mass = {1, 5, 2};
  Motion<2> v = {{0.5, -1}, {0.25, -2}, {1, -0.5}};
  const double before = kinetic<2>(mass, v);
  double lost = 1;
  ASSERT_TRUE(solve_reactions<2>(contacts, mass, v, &lost));
  EXPECT_NEAR(lost, 1 + before - kinetic<2>(mass, v), 1e-14);
}

TEST(SolveReactions, ClustersDoNotFeelEachOther) {
  // Two columns and a triangle with interleaved ids.
  const auto member = [](Id cluster, Id k) { return 3 * k + cluster; };
  constexpr Id kEach = 4;
  Contacts<2> all;
  for (Id k = 0; k + 1 < kEach; ++k) {
    for (const Id column : {0u, 1u})
      all.push_back(pair<2>(member(column, k), member(column, k + 1), {0.1 * column, -1}));
    all.push_back(pair<2>(member(2, k), member(2, k + 1), {k == 0 ? -1.0 : 0.5, -0.7}));
  }
  all.push_back(at_wall<2>(member(0, 0), kFloor2));
  all.push_back(at_wall<2>(member(1, 0), kFloor2));
  std::ranges::sort(all, {}, &RestingContact<2>::key);
  std::vector<double> mass;
  Motion<2> given;
  for (Id i = 0; i < 3 * kEach; ++i) {
    mass.push_back(1 + 0.3 * i);
    given.emplace_back(std::sin(i), -1 - 0.1 * i);
  }
  Motion<2> together = given;
  ASSERT_TRUE(solve_reactions<2>(all, mass, together));
  Motion<2> one_by_one = given;
  for (const Id cluster : {0u, 1u, 2u}) {
    Contacts<2> own;
    for (auto contact : all)
      if (contact.key.lo % 3 == cluster) own.push_back(contact);
    for (auto& contact : own) contact.lambda = 0;
    ASSERT_TRUE(solve_reactions<2>(own, mass, one_by_one));
    for (const auto& contact : own)
      EXPECT_EQ(contact.lambda, std::ranges::find(all, contact.key, &RestingContact<2>::key)->lambda);
  }
  EXPECT_EQ(one_by_one, together);
}

TEST(SolveReactions, ASquareCrystalBetweenWallsStays) {
  // Any force also presses its rows from wall to wall: the motion is unique, the reactions are not.
  constexpr Id n = 12;
  Contacts<2> contacts;
  for (Id row = 0; row < n; ++row)
    for (Id k = 0; k < n; ++k) {
      const Id i = row * n + k;
      if (k + 1 < n) contacts.push_back(pair<2>(i, i + 1, {-1, 0}));
      if (row + 1 < n) contacts.push_back(pair<2>(i, i + n, {0, -1}));
      if (row == 0) contacts.push_back(at_wall<2>(i, kFloor2));
      if (k == 0) contacts.push_back(at_wall<2>(i, 0));
      if (k == n - 1) contacts.push_back(at_wall<2>(i, 1));
    }
  std::ranges::sort(contacts, {}, &RestingContact<2>::key);
  const std::vector<double> mass(n * n, 1.0);
  RandomStream random(1, RandomPurpose::probe, 0);
  Motion<2> w;
  for (Id i = 0; i < n * n; ++i) w.emplace_back(2 * random.uniform() - 1, -1 - random.uniform());
  ASSERT_TRUE(solve_reactions<2>(contacts, mass, w));
  EXPECT_LE(largest<2>(w), 1e-13);
  for (const auto& contact : contacts) EXPECT_GE(contact.lambda, 0);
}

TEST(SolveReactions, KnownReactionsStay) {
  auto contacts = column(9);
  const std::vector<double> mass(9, 0.7);
  const Motion<2> given(9, {0.25, -1.0 / 3});
  Motion<2> w = given;
  ASSERT_TRUE(solve_reactions<2>(contacts, mass, w));
  std::vector<double> found;
  for (const auto& contact : contacts) found.push_back(contact.lambda);
  const auto expect_unchanged = [&] {
    for (std::size_t k = 0; k < contacts.size(); ++k) EXPECT_EQ(contacts[k].lambda, found[k]);
  };
  const Motion<2> held = w;
  w = given;
  ASSERT_TRUE(solve_reactions<2>(contacts, mass, w));
  expect_unchanged();
  EXPECT_EQ(w, held);
  // An error below the slack stays, and a larger one is corrected.
  for (auto& contact : contacts) contact.slack = 1e-9;
  w = given;
  for (auto& each : w) each[1] *= 1 + 1e-9;
  ASSERT_TRUE(solve_reactions<2>(contacts, mass, w));
  expect_unchanged();
  w = given;
  for (auto& each : w) each[1] *= 1 + 1e-7;
  ASSERT_TRUE(solve_reactions<2>(contacts, mass, w));
  EXPECT_NEAR(contacts.back().lambda / found.back(), 1 + 1e-7, 1e-13);
  EXPECT_LE(std::abs(w[4][1]), 1e-14);
  // Reactions that are no longer needed are removed.
  w.assign(9, {0, 1});
  for (Id k = 0; k < 9; ++k) w[k][1] = 1 + k;
  ASSERT_TRUE(solve_reactions<2>(contacts, mass, w));
  for (const auto& contact : contacts) EXPECT_EQ(contact.lambda, 0);
}

/// A problem with a solution: the bounds are at most those of a possible motion.
template <int D>
struct RandomCluster {
  explicit RandomCluster(std::uint32_t number) {
    RandomStream random(7, RandomPurpose::probe, number);
    const auto signed_uniform = [&] { return 2 * random.uniform() - 1; };
    const auto vector = [&] {
      Vec<D> each;
      for (int k = 0; k < D; ++k) each[k] = signed_uniform();
      return each;
    };
    const Id bodies = 2 + number % 4;
    Motion<D> motion;
    for (Id i = 0; i < bodies; ++i) {
      mass.push_back(std::pow(10, 2 * signed_uniform()));
      w.push_back(vector());
      motion.push_back(vector());
    }
    const std::uint32_t most = std::min(8u, D * bodies + 1);
    for (std::uint32_t k = 0; k < 1 + number / 4 % most; ++k) {
      const auto lo = static_cast<Id>(random.uniform() * bodies), hi = static_cast<Id>(random.uniform() * bodies);
      if (lo == hi)
        contacts.push_back(at_wall<D>(lo, static_cast<Id>(random.uniform() * 2 * D)));
      else
        contacts.push_back(pair<D>(std::min(lo, hi), std::max(lo, hi), vector()));
      if (number % 2 == 0) continue;
      contacts.back().bound = opening(contacts.back(), motion) - std::max(0.0, signed_uniform());
    }
  }
  std::vector<double> mass;
  Motion<D> w;
  Contacts<D> contacts;
};

/// The motion, by trying all sets of contacts with reactions whose normals are independent.
template <int D>
std::optional<Motion<D>> by_all_sets(const RandomCluster<D>& given) {
  const auto m = static_cast<Eigen::Index>(given.contacts.size());
  const auto n = static_cast<Eigen::Index>(D * given.mass.size());
  Eigen::MatrixXd normals = Eigen::MatrixXd::Zero(m, n);
  Eigen::VectorXd inverse_mass(n), w(n), bound(m);
  for (Eigen::Index i = 0; i < n; ++i) {
    inverse_mass[i] = 1 / given.mass[i / D];
    w[i] = given.w[i / D][i % D];
  }
  for (Eigen::Index k = 0; k < m; ++k) {
    const auto& contact = given.contacts[k];
    normals.row(k).segment<D>(D * contact.key.lo) = contact.normal;
    if (contact.key.kind == EventKind::pair) normals.row(k).segment<D>(D * contact.key.hi) = -contact.normal;
    bound[k] = contact.bound;
  }
  for (int set = 0; set < 1 << m; ++set) {
    std::vector<Eigen::Index> active;
    for (Eigen::Index k = 0; k < m; ++k)
      if (set >> k & 1) active.push_back(k);
    Eigen::VectorXd moved = w;
    if (!active.empty()) {
      const Eigen::MatrixXd chosen = normals(active, Eigen::all);
      const Eigen::FullPivLU<Eigen::MatrixXd> matrix(chosen * inverse_mass.asDiagonal() * chosen.transpose());
      if (!matrix.isInvertible()) continue;
      const Eigen::VectorXd missing = bound(active) - chosen * w, lambda = matrix.solve(missing);
      if (lambda.minCoeff() < 0) continue;
      moved += inverse_mass.asDiagonal() * chosen.transpose() * lambda;
    }
    if ((normals * moved - bound).minCoeff() < -1e-10) continue;
    Motion<D> found;
    for (Eigen::Index i = 0; i < n; i += D) found.push_back(moved.segment<D>(i));
    return found;
  }
  return {};
}

template <int D>
void expect_all_sets_agree() {
  int opened = 0, pressed = 0;
  for (std::uint32_t number = 0; number < 600; ++number) {
    SCOPED_TRACE(number);
    RandomCluster<D> cluster(number);
    const auto expected = by_all_sets(cluster);
    ASSERT_TRUE(expected);
    auto w = cluster.w;
    ASSERT_TRUE(solve_reactions<D>(cluster.contacts, cluster.mass, w));
    double size = 1;
    for (const auto& contact : cluster.contacts)
      size = std::max(size, contact.lambda * contact.normal.norm() * 100);  // the lightest body weighs 1/100
    for (Id i = 0; i < w.size(); ++i) EXPECT_LE((w[i] - (*expected)[i]).cwiseAbs().maxCoeff(), 1e-9) << i;
    for (const auto& contact : cluster.contacts) {
      const double over = opening(contact, w) - contact.bound;
      EXPECT_GE(contact.lambda, 0);
      EXPECT_GE(over, -1e-14 * size);
      EXPECT_LE(contact.lambda > 0 ? over : 0, 1e-14 * size);
      (contact.lambda > 0 ? pressed : opened) += 1;
    }
  }
  EXPECT_GT(opened, 500);
  EXPECT_GT(pressed, 500);
}

/// Clusters for which exchanging all wrong contacts at once does not end.
template <int D>
void expect_an_end(std::initializer_list<std::uint32_t> numbers) {
  for (const std::uint32_t number : numbers) {
    SCOPED_TRACE(number);
    RandomCluster<D> cluster(number);
    const auto expected = by_all_sets(cluster);
    ASSERT_TRUE(expected);
    EXPECT_TRUE(solve_reactions<D>(cluster.contacts, cluster.mass, cluster.w));
    for (Id i = 0; i < cluster.w.size(); ++i) EXPECT_LE((cluster.w[i] - (*expected)[i]).norm(), 1e-9) << i;
  }
}
TEST(SolveReactions, ExchangesComeToAnEnd) {
  expect_an_end<2>({1352, 2348});
  expect_an_end<3>({636});
}

TEST(SolveReactions, AgreesWithAllSetsOfContactsInTwoDimensions) { expect_all_sets_agree<2>(); }
TEST(SolveReactions, AgreesWithAllSetsOfContactsInThreeDimensions) { expect_all_sets_agree<3>(); }

/// Expects that normal velocities become 0, and that energy and momentum along `free` axes are conserved.
template <int D>
void expect_kept(Contacts<D> contacts, const std::vector<double>& mass, Motion<D> v, const Vec<D>& free) {
  const double energy = kinetic<D>(mass, v);
  const Vec<D> before = momentum<D>(mass, v);
  EXPECT_EQ(keep_tangential<D>(contacts, mass, v), 0);
  for (const auto& contact : contacts) EXPECT_NEAR(opening(contact, v), 0, 1e-14);
  EXPECT_NEAR(kinetic<D>(mass, v), energy, 1e-14 * energy);
  EXPECT_LE(free.cwiseProduct(momentum<D>(mass, v) - before).cwiseAbs().maxCoeff(), 1e-14 * before.norm());
}

TEST(KeepTangential, AFreePairOfUnequalMasses) {
  for (const double normal_speed : {0.1, -0.1}) {
    for (const std::vector<double>& mass : {std::vector<double>{1, 1}, {1, 7}, {7, 1}, {1e-3, 1}}) {
      expect_kept<2>({pair<2>(0, 1, {-1, 0})}, mass, {{normal_speed + 3, 2}, {3, -1}}, {1, 1});
      expect_kept<3>({pair<3>(0, 1, {-1, 0, 0})}, mass, {{normal_speed + 3, 2, 1}, {3, -1, 0.5}}, {1, 1, 1});
    }
  }
  // In closed form: the centre of mass, at (0, 1/2), continues; the energy of the relative motion is now tangential.
  Contacts<2> contacts = {pair<2>(0, 1, {-2, 0})};
  Motion<2> v = {{-0.3, 2}, {0.1, 0}};
  EXPECT_EQ(keep_tangential<2>(contacts, {1, 3}, v), 0);
  const double relative = std::hypot(0.4, 2.0);
  EXPECT_NEAR(v[0][1], 0.5 + 0.75 * relative, 1e-15);
  EXPECT_NEAR(v[1][1], 0.5 - 0.25 * relative, 1e-15);
  EXPECT_NEAR(v[0][0], 0, 1e-16);
}

TEST(KeepTangential, OnWalls) {
  const double small = 0.05;
  for (const std::vector<double>& mass : {std::vector<double>{1, 1}, {1, 7}, {7, 1}}) {
    // Side by side on the floor; then one on top of another that slides on the floor.
    expect_kept<2>({pair<2>(0, 1, {0, -1}), at_wall<2>(0, kFloor2)}, mass, {{2, -small}, {-1, small}}, {1, 0});
    expect_kept<3>({pair<3>(0, 1, {0, 0, -1}), at_wall<3>(0, kFloor3)}, mass, {{2, 1, small}, {-1, 0.5, 0}}, {1, 1, 0});
    // In a corner, only the third axis is free.
    expect_kept<3>({pair<3>(0, 1, {0, -1, -1}), at_wall<3>(0, kFloor3), at_wall<3>(0, 2)}, mass,
                   {{2, small, small}, {-1, 0.5, -0.5 + small}}, {1, 0, 0});
  }
  // A single sphere has no motion to stretch: its momentum along the wall is conserved.
  Contacts<2> contacts = {at_wall<2>(0, kFloor2)};
  Motion<2> v = {{0.8, 0.125}};
  EXPECT_EQ(keep_tangential<2>(contacts, {2}, v), 0.015625);
  EXPECT_EQ(v[0], Vec<2>(0.8, 0));
}

TEST(KeepTangential, EachClusterKeepsItsOwn) {
  const std::vector<double> mass = {1, 4, 2, 3};
  const Motion<2> given = {{0.1, 2}, {5, 5}, {0, -1}, {5.1, 9}};
  Contacts<2> contacts = {pair<2>(0, 2, {-1, 0}), pair<2>(1, 3, {-1, 0})};
  Motion<2> v = given;
  EXPECT_EQ(keep_tangential<2>(contacts, mass, v), 0);
  const auto energy = [&](const Motion<2>& of, Id i, Id j) {
    return 0.5 * (mass[i] * of[i].squaredNorm() + mass[j] * of[j].squaredNorm());
  };
  EXPECT_NEAR(energy(v, 0, 2), energy(given, 0, 2), 1e-15);
  EXPECT_NEAR(energy(v, 1, 3), energy(given, 1, 3), 1e-13);
}

TEST(KeepTangential, TellsWhatItCannotGiveBack) {
  const std::vector<double> mass = {1, 3};
  const Motion<2> given = {{0.5, 0.2}, {0, 0.1}};
  Contacts<2> contacts = {pair<2>(0, 1, {-1, 0})};
  Motion<2> v = given;
  const double lacks = keep_tangential<2>(contacts, mass, v);
  EXPECT_NEAR(lacks, kinetic<2>(mass, given) - kinetic<2>(mass, v), 1e-16);
  EXPECT_NEAR(v[0][0], 0.125, 1e-15);
  EXPECT_NEAR(v[1][0], 0.125, 1e-15);
  EXPECT_EQ(v[0][1], 0.2);
}

TEST(KeepTangential, LeavesWhatIsTangentialToRounding) {
  Contacts<2> contacts = {pair<2>(0, 1, {-1, 0})};
  contacts[0].slack = 1e-12;
  Motion<2> v = {{5e-13, 1}, {0, -1}};
  const Motion<2> given = v;
  EXPECT_EQ(keep_tangential<2>(contacts, {1, 2}, v), 0);
  EXPECT_EQ(v, given);
}

}  // namespace
}  // namespace carom::resting_test
