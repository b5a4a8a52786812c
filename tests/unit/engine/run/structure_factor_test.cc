// SPDX-License-Identifier: BSD-3-Clause
// S(k) against sums over all particles, and over any division of them.

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <map>
#include <numbers>

#include "engine/base/random.h"
#include "engine/run/observable.h"
#include "tests/support/experiments.h"

namespace carom::structure_factor_test {
namespace {

constexpr double kPi = std::numbers::pi;

/// Points of two species with charges.
template <int D>
std::unique_ptr<System<D>> random_points(std::size_t n, const Vec<D>& edges, unsigned seed = 3) {
  std::vector<Vec<D>> x(n);
  for (std::size_t i = 0; i < n; ++i) {
    RandomStream random(seed, RandomPurpose::probe, static_cast<std::uint32_t>(i));
    for (int k = 0; k < D; ++k) x[i][k] = edges[k] * random.uniform();
  }
  auto system = test::make_system<D>(edges, Boundary::periodic, x, std::vector<Vec<D>>(n, Vec<D>::Zero()),
                                     std::vector<double>(n, 0.01));
  system->species = {"a", "b"};
  for (std::size_t i = 0; i < n; ++i) {
    system->particles.species[i] = i % 3 == 0;
    system->particles.charge[i] = i % 3 == 0 ? -4.0 : 2.0 + static_cast<double>(i % 2);
  }
  return system;
}

std::map<std::string, std::vector<double>> columns_of(const std::vector<TableColumn>& table) {
  std::map<std::string, std::vector<double>> columns;
  for (const TableColumn& column : table) columns[column.name] = column.values;
  return columns;
}

/// Σ w e^(ik·x) over the particles of a species, or all.
template <int D>
std::complex<double> wave_sum(const Particles<D>& p, const Vec<D>& k, int species, bool charges) {
  std::complex<double> sum;
  for (std::size_t i = 0; i < p.size(); ++i)
    if (species < 0 || p.species[i] == species) sum += (charges ? p.charge[i] : 1) * std::polar(1.0, k.dot(p.x[i]));
  return sum;
}

/// The rows of the smallest k have all their waves, here found among all.
template <int D>
void expect_brute_force(const Vec<D>& edges) {
  const std::size_t n = 200;
  const auto system = random_points<D>(n, edges);
  const double smallest = 2 * kPi / edges.maxCoeff();
  const auto sk = make_observable("sk", *system, {{"interval", 1.0}, {"range", 12 * smallest}, {"waves", 7}});
  EXPECT_TRUE(sk->divided());
  sk->sample(0, system->particles);
  const auto table = columns_of(sk->table());
  std::map<double, std::array<double, 6>> expected;  // by |k|: number, S, S_a_a, S_a_b, S_b_b, S_charge
  Vec<D> wave;
  const int most = 4;
  for (int code = 0; code < std::pow(2 * most + 1, D); ++code) {
    int rest = code;
    for (int k = 0; k < D; ++k, rest /= 2 * most + 1) wave[k] = 2 * kPi / edges[k] * (rest % (2 * most + 1) - most);
    if (wave.norm() == 0 || wave.norm() > 4 * smallest * (1 + 1e-9)) continue;
    auto at = expected.lower_bound(wave.norm() * (1 - 1e-9));
    if (at == expected.end() || at->first > wave.norm() * (1 + 1e-9)) at = expected.insert({wave.norm(), {}}).first;
    const auto a = wave_sum<D>(system->particles, wave, 0, false), b = wave_sum<D>(system->particles, wave, 1, false);
    const double all = std::norm(a + b), charge = std::norm(wave_sum<D>(system->particles, wave, -1, true));
    const std::array terms = {1.0, all, std::norm(a), (a * std::conj(b)).real(), std::norm(b), charge};
    for (std::size_t k = 0; k < terms.size(); ++k) at->second[k] += terms[k];
  }
  std::size_t row = 0;
  for (const auto& [k, sums] : expected) {
    EXPECT_NEAR(table.at("k")[row], k, 1e-12 * k);
    EXPECT_EQ(table.at("waves")[row], sums[0] / 2);
    std::size_t column = 1;
    for (const char* name : {"S", "S_a_a", "S_a_b", "S_b_b", "S_charge"}) {
      const double mean = sums[column++] / sums[0] / static_cast<double>(n);
      EXPECT_NEAR(table.at(name)[row], mean, 1e-9 * (1 + std::abs(mean))) << name << ' ' << k;
    }
    ++row;
  }
  ASSERT_GT(table.at("k").size(), row + 3);
  for (; row < table.at("k").size(); ++row) {
    EXPECT_GE(table.at("k")[row], table.at("k")[row - 1]);
    EXPECT_LE(table.at("waves")[row], 7);
    EXPECT_NEAR(table.at("S")[row], table.at("S_a_a")[row] + 2 * table.at("S_a_b")[row] + table.at("S_b_b")[row], 1e-9);
  }
}

TEST(StructureFactor, IsTheSumOverAllParticles) {
  expect_brute_force<2>({5, 5});
  expect_brute_force<2>({3, 7});
  expect_brute_force<3>({5, 5, 5});
  expect_brute_force<3>({3, 4.5, 5});
}

/// ρ(k) of a lattice is N at its reciprocal vectors and 0 elsewhere.
TEST(StructureFactor, OfALatticeHasBraggPeaks) {
  const auto system = test::hard_spheres<3>(3, 0.3);  // fcc
  const double edge = system->box.edges[0], smallest = 2 * kPi / edge;
  const auto sk = make_observable("sk", *system, {{"interval", 1.0}, {"range", smallest * 4}});
  sk->sample(0, system->particles);
  const auto columns = columns_of(sk->table());
  for (const double s : columns.at("S")) EXPECT_NEAR(s, 0, 1e-12);
  const auto further = make_observable("sk", *system, {{"interval", 1.0}, {"range", smallest * 6}, {"waves", 1000}});
  further->sample(0, system->particles);
  const auto table = columns_of(further->table());
  // In the shell from 5 to 6 of the smallest k, 25 < n² ≤ 36, four vectors (3, 3, 3) and three (6, 0, 0): 108 each.
  EXPECT_NEAR(table.at("S").back() * table.at("waves").back(), 7 * 108, 1e-6);
  EXPECT_EQ(table.count("S_charge"), 0u);
}

TEST(StructureFactor, OfAnIdealGasIsOne) {
  const std::size_t n = 100;
  const auto system = random_points<3>(n, {4, 5, 6});
  const auto sk = make_observable("sk", *system, {{"interval", 1.0}, {"range", 9.0}, {"waves", 10}});
  for (unsigned s = 0; s < 400; ++s) sk->sample(s, random_points<3>(n, {4, 5, 6}, 100 + s)->particles);
  const auto table = columns_of(sk->table());
  double chi_square = 0, charge = 0;
  for (const double q : system->particles.charge) charge += q * q / static_cast<double>(n);
  const std::size_t rows = table.at("k").size();
  double ratios = 0;
  for (std::size_t row = 0; row < rows; ++row) {
    const double error = table.at("error_S")[row], t = (table.at("S")[row] - 1) / error;
    const double expected = 1 / std::sqrt(400 * table.at("waves")[row]);
    EXPECT_NEAR(error, expected, 0.5 * expected) << row;
    ratios += error * error / (expected * expected * static_cast<double>(rows));
    EXPECT_LT(std::abs(t), 4.5);
    chi_square += t * t;
    EXPECT_NEAR(table.at("S_charge")[row], charge, 5 * table.at("error_S_charge")[row]);
    EXPECT_NEAR(table.at("S_a_b")[row], 0, 5 * table.at("error_S_a_b")[row]);
  }
  EXPECT_NEAR(chi_square / static_cast<double>(rows), 1.1, 0.6);
  EXPECT_NEAR(ratios, 1, 0.15);
}

TEST(StructureFactor, RefusesABoxWithoutWaves) {
  auto system = test::make_system<2>({8, 5}, Boundary::periodic, {{1, 1}}, {{0, 0}});
  EXPECT_NO_THROW(make_observable("sk", *system, {{"interval", 1.0}}));
  EXPECT_THROW(make_observable("sk", *system, {{"interval", 1.0}, {"range", 0.5}}), Error);
  system->box.boundary[1] = Boundary::wall;
  EXPECT_THROW(make_observable("sk", *system, {{"interval", 1.0}}), Error);
}

}  // namespace
}  // namespace carom::structure_factor_test
