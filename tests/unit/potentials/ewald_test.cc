// SPDX-License-Identifier: BSD-3-Clause
// The Ewald sum: lattice energies, forces and energies against a sum in 50-digit arithmetic with another split, errors
// against the accuracy asked for, the discrete gradient, and bits that depend on no order.

#include "engine/forces/potentials/ewald.h"

#include <gtest/gtest.h>

#include <boost/math/constants/constants.hpp>
#include <boost/math/special_functions/erf.hpp>
#include <numbers>

#include "engine/base/error.h"
#include "tests/unit/potentials/precise.h"
#include "tests/unit/potentials/scene.h"

namespace carom::ewald_test {
namespace {

using namespace std::string_literals;
using test::displaced;
using test::energy;
using test::forces;
using test::mean_forces;
using test::Precise;
using test::Scene;

constexpr double kPi = std::numbers::pi;

std::unique_ptr<Interaction<3>> ewald(const Scene<3>& scene, double accuracy, const std::string& surface = "conducting",
                                      double constant = 1) {
  return scene.make("coulomb",
                    {{"constant", constant}, {"form", "ewald"s}, {"accuracy", accuracy}, {"surface", surface}});
}

std::unique_ptr<Interaction<3>> ewald_between_walls(const Scene<3>& scene, double accuracy,
                                                    const std::vector<double>& wall_charges = {0, 0}) {
  return scene.make("coulomb",
                    {{"constant", 1.0}, {"form", "ewald"s}, {"accuracy", accuracy}, {"wall_charges", wall_charges}});
}

/// A crystal of `cells`³ cubic cells of edge 1, each with these ions.
Scene<3> crystal(int cells, const std::vector<std::pair<Vec<3>, double>>& ions) {
  Scene<3> scene(0, cells, Boundary::periodic, 0);
  auto& p = scene.particles;
  for (int a = 0; a < cells; ++a)
    for (int b = 0; b < cells; ++b)
      for (int c = 0; c < cells; ++c)
        for (const auto& [x, charge] : ions) {
          p.x.push_back(x + Vec<3>(a, b, c));
          p.v.push_back(Vec<3>::Zero());
          p.mass.push_back(1);
          p.radius.push_back(0.1);
          p.charge.push_back(charge);
          p.species.push_back(charge > 0 ? 0 : 1);
          p.image.push_back({});
        }
  return scene;
}

TEST(Ewald, GivesTheMadelungConstantsOfRockSaltAndCaesiumChloride) {
  std::vector<std::pair<Vec<3>, double>> salt;
  for (int n = 0; n < 8; ++n) {
    const Vec<3> x(n % 2, n / 2 % 2, n / 4);
    salt.emplace_back(0.5 * x, std::lround(x.sum()) % 2 == 0 ? 1.0 : -1.0);
  }
  const std::vector<std::pair<Vec<3>, double>> caesium = {{Vec<3>::Zero(), 1.0}, {Vec<3>::Constant(0.5), -1.0}};
  for (const int cells : {1, 2, 3})
    for (const double accuracy : {1e-12}) {
      const Scene<3> rock = crystal(cells, salt), cubic = crystal(cells, caesium);
      // The energy of a pair of ions is −M q²/d, d the distance of neighbours.
      EXPECT_NEAR(-energy(*ewald(rock, accuracy), rock.particles.x) * 0.5 / (4 * cells * cells * cells),
                  1.7475645946331821906, 1e-12);
      EXPECT_NEAR(-energy(*ewald(cubic, accuracy), cubic.particles.x) * std::sqrt(0.75) / (cells * cells * cells),
                  1.7626747730709883, 1e-12);
      for (const auto& f : forces(*ewald(rock, accuracy), rock.particles.x)) EXPECT_LE(f.norm(), 1e-12);
    }
}

/// V and forces of unit constant in 50-digit arithmetic, α = 5/L: pairs with e^(−α²r²) and waves with e^(−k²/4α²) below
/// e^(−42) = 6e-19 are left out.
struct PreciseSum {
  Precise energy = 0;
  std::vector<std::array<Precise, 3>> force;
};

PreciseSum precise_sum(const Scene<3>& scene, bool vacuum) {
  using boost::math::constants::pi;
  const Precise tau = 2 * pi<Precise>();
  const auto& p = scene.particles;
  const Vec<3> edges = scene.box.edges;
  const Precise alpha = Precise(5) / edges.minCoeff(), a2 = alpha * alpha;
  const Precise volume = Precise(edges[0]) * edges[1] * edges[2], slope = 2 * alpha / sqrt(pi<Precise>());
  PreciseSum sum;
  sum.force.resize(p.size());
  Precise total = 0;
  std::array<Precise, 3> dipole{};
  for (Id i = 0; i < p.size(); ++i) {
    const Precise q = p.charge[i];
    total += q;
    sum.energy -= alpha / sqrt(pi<Precise>()) * q * q;
    for (int k = 0; k < 3; ++k) dipole[k] += q * p.x[i][k];
    for (Id j = 0; j <= i; ++j)
      for (int n = 0; n < 125; ++n) {
        const std::array<int, 3> image{n % 5 - 2, n / 5 % 5 - 2, n / 25 - 2};
        if (i == j && n == 62) continue;
        std::array<Precise, 3> d;
        Precise squared = 0;
        for (int k = 0; k < 3; ++k) {
          d[k] = Precise(p.x[i][k]) - Precise(p.x[j][k]) + Precise(image[k]) * Precise(edges[k]);
          squared += d[k] * d[k];
        }
        if (a2 * squared > 42) continue;  // e^(−42) = 6e-19
        const Precise r = sqrt(squared), value = boost::math::erfc(Precise(alpha * r)) / r;
        const Precise qq = q * p.charge[j];
        sum.energy += (i == j ? Precise(0.5) : Precise(1)) * qq * value;
        for (int k = 0; i != j && k < 3; ++k) {
          const Precise f = qq * (value + slope * exp(-a2 * squared)) / squared * d[k];
          sum.force[i][k] += f;
          sum.force[j][k] -= f;
        }
      }
  }
  for (int a = 0; a <= 14; ++a)
    for (int b = a == 0 ? 0 : -14; b <= 14; ++b)
      for (int c = a == 0 && b == 0 ? 1 : -14; c <= 14; ++c) {
        const std::array<Precise, 3> k{tau * a / edges[0], tau * b / edges[1], tau * c / edges[2]};
        const Precise k2 = k[0] * k[0] + k[1] * k[1] + k[2] * k[2];
        if (k2 / (4 * a2) > 42) continue;
        const Precise weight = 2 * tau / k2 * exp(-k2 / (4 * a2)) / volume;
        std::vector<Precise> cosine, sine;
        Precise re = 0, im = 0;
        for (Id j = 0; j < p.size(); ++j) {
          const Precise phase = k[0] * p.x[j][0] + k[1] * p.x[j][1] + k[2] * p.x[j][2];
          cosine.push_back(cos(phase));
          sine.push_back(sin(phase));
          re += p.charge[j] * cosine[j];
          im += p.charge[j] * sine[j];
        }
        sum.energy += weight * (re * re + im * im);
        for (Id j = 0; j < p.size(); ++j)
          for (int m = 0; m < 3; ++m)
            sum.force[j][m] += 2 * weight * p.charge[j] * k[m] * (re * sine[j] - im * cosine[j]);
      }
  sum.energy -= pi<Precise>() * total * total / (2 * a2 * volume);
  if (!vacuum) return sum;
  for (int k = 0; k < 3; ++k) {
    sum.energy += tau / (3 * volume) * dipole[k] * dipole[k];
    for (Id j = 0; j < p.size(); ++j) sum.force[j][k] -= 2 * tau / (3 * volume) * p.charge[j] * dipole[k];
  }
  return sum;
}

TEST(Ewald, ForcesAndEnergyAreThoseOf50DigitArithmeticWithAnotherSplit) {
  for (const bool neutral : {true, false})
    for (const bool vacuum : {false, true}) {
      if (vacuum && !neutral) continue;
      Scene<3> scene(6, 4, Boundary::periodic, 0.9);
      scene.box.edges = {4, 4.5, 5};
      if (neutral)
        for (Id i = 0; i < 6; ++i) scene.particles.charge[i] = i < 2 ? 2 : -1;
      const PreciseSum exact = precise_sum(scene, vacuum);
      const auto term = ewald(scene, 1e-12, vacuum ? "vacuum" : "conducting");
      EXPECT_NEAR(energy(*term, scene.particles.x), static_cast<double>(exact.energy), 1e-13 * 30);
      const auto f = forces(*term, scene.particles.x);
      for (Id i = 0; i < 6; ++i)
        for (int k = 0; k < 3; ++k)
          EXPECT_NEAR(f[i][k], static_cast<double>(exact.force[i][k]), 2e-13) << i << ' ' << k << ' ' << vacuum;
    }
}

TEST(Ewald, ErrorsAreBelowTheAccuracyAskedForAndNotFarBelow) {
  for (const bool neutral : {true, false}) {
    Scene<3> scene(200, 6, Boundary::periodic, 0.6);
    auto& q = scene.particles.charge;
    if (neutral)
      for (Id i = 0; i < q.size(); ++i) q[i] = i % 2 == 0 ? 1 : -1;
    double squares = 0;
    for (const double each : q) squares += each * each;
    const double n = static_cast<double>(q.size());
    const double unit = squares / n / std::pow(scene.box.edges.prod() / n, 2.0 / 3);
    const auto exact = forces(*ewald(scene, 1e-12), scene.particles.x);
    const double exact_energy = energy(*ewald(scene, 1e-12), scene.particles.x);
    for (double accuracy = 1e-2; accuracy > 1e-11; accuracy /= 10) {
      const auto term = ewald(scene, accuracy);
      const auto f = forces(*term, scene.particles.x);
      double sum = 0;
      for (Id i = 0; i < q.size(); ++i) sum += (f[i] - exact[i]).squaredNorm();
      const double error = std::sqrt(sum / n) / unit, of_energy = energy(*term, scene.particles.x) - exact_energy;
      EXPECT_LE(error, accuracy);
      EXPECT_GE(error, 0.02 * accuracy);
      EXPECT_LE(std::abs(of_energy), accuracy * std::abs(exact_energy)) << accuracy;
      std::cout << accuracy << ": force " << error << ", energy " << of_energy / exact_energy << '\n';
    }
  }
}

TEST(Ewald, ManyChargesGetMoreWavesInsteadOfListsLargerThanMemory) {
  for (const double n : {1e4, 1e5, 1e6}) {
    ChargeSums charges;
    for (auto* each : {&charges.absolute, &charges.squares, &charges.count}) each->add(n);
    const double volume = 8 * n, edge = std::cbrt(volume);
    for (const double accuracy : {1e-4, 1e-9}) {
      const EwaldSplit split = ewald_split(accuracy, charges, volume, volume, 0.5 * edge);
      EXPECT_LE(4 * kPi / 3 * std::pow(split.cutoff, 3) / 8, 6001) << n << ' ' << accuracy;
      // The pair term at its cutoff and the longest wave left out have become small enough for the accuracy.
      const double left = split.alpha * split.switch_from, waves = split.wave_cutoff / (2 * split.alpha);
      for (const double ratio : {left, waves}) {
        EXPECT_LT(std::exp(-ratio * ratio), 10 * accuracy) << n;
        EXPECT_GT(std::exp(-ratio * ratio), 0.01 * accuracy) << n;
      }
    }
  }
}

/// The work of the mean forces is exact, and their sum is zero.
void expect_exact_work(const Scene<3>& scene, const Interaction<3>& term, const std::vector<Vec<3>>& x,
                       const std::vector<Vec<3>>& x_new) {
  ForceSums<3> sums(x.size(), test::kQuantum);
  term.add_mean_forces(x, x_new, sums);
  std::array<ForceSums<3>::Whole, 3> net{};
  ExactSum work;
  double scale = 0;
  for (Id i = 0; i < x.size(); ++i)
    for (int k = 0; k < 3; ++k) {
      net[k] += sums.quanta(i)[k];
      work.add(sums.value(i)[k] * (x_new[i][k] - x[i][k]));
      scale += std::abs(sums.value(i)[k]) * scene.box.edges[k];
    }
  for (int k = 0; k < 3; ++k) EXPECT_EQ(static_cast<long>(net[k]), 0);
  const auto before = test::sums(term, x), after = test::sums(term, x_new);
  EXPECT_NEAR(work.value(), before.energy.value() - after.energy.value(),
              5e-16 * (scale + before.magnitude.value() + after.magnitude.value()));
}

TEST(Ewald, MeanForcesDoExactlyTheWorkAndTheirSumIsZeroBitByBit) {
  Scene<3> scene(60, 6, Boundary::periodic, 0.7);
  for (Id i = 0; i < 60; ++i) scene.particles.charge[i] = i % 3 == 0 ? 2 : -1;
  scene.particles.charge[5] = scene.particles.charge[6] = scene.particles.charge[7] = 0;
  scene.particles.charge[9] = 1, scene.particles.charge[12] = 3;
  double total = 0;
  for (const double q : scene.particles.charge) total += q;
  scene.particles.charge[0] -= total;
  const auto& x = scene.particles.x;
  for (const auto& surface : {"conducting"s, "vacuum"s}) {
    const auto term = ewald(scene, 1e-6, surface);
    for (const double size : {1e-9, 1e-4, 0.01, 0.03, 0.05, 0.1, 0.4}) {
      // With a drift: the net force vanishes although all particles move far.
      auto w = scene.random_vectors(size);
      for (auto& each : w) each += Vec<3>(0.3, -0.2, 0.1);
      const auto x_new = displaced(x, w, 1);
      expect_exact_work(scene, *term, x, x_new);
    }
  }
}

/// The energy of two unit charges at a distance d and all their images along x and y alone, with a split of its own:
/// pairs, waves along the walls, and the fields of sheets of charge (de Leeuw, Perram, Mol. Phys. 37 (1979) 1313);
/// without the charge itself if d is zero.
long double slab_pair(const Vec<3>& edges, const std::array<long double, 3>& d, long double alpha) {
  const long double pi = std::acos(-1.0L), area = edges[0] * edges[1], z = d[2];
  long double sum =
      -2 * pi / area * (z * std::erf(alpha * z) + std::exp(-alpha * alpha * z * z) / (alpha * std::sqrt(pi)));
  for (int a = -2; a <= 2; ++a)
    for (int b = -2; b <= 2; ++b) {
      const long double x = d[0] + a * edges[0], y = d[1] + b * edges[1], r = std::sqrt(x * x + y * y + z * z);
      sum += r > 0 ? std::erfc(alpha * r) / r : -2 * alpha / std::sqrt(pi);
    }
  for (int a = -8; a <= 8; ++a)
    for (int b = a > 0 ? 0 : 1; b <= 8; ++b) {  // one half of them: a > 0 and b = 0, or b > 0
      const long double u = 2 * pi * a / edges[0], v = 2 * pi * b / edges[1], k = std::sqrt(u * u + v * v);
      const auto side = [&](long double s) { return std::exp(k * s) * std::erfc(k / (2 * alpha) + alpha * s); };
      sum += 2 * pi / (area * k) * std::cos(u * d[0] + v * d[1]) * (side(z) + side(-z));
    }
  return sum;
}

/// Ions in a box between walls along z.
Scene<3> slab(const Vec<3>& edges) {
  Scene<3> scene(0, 1, Boundary::periodic, 0);
  scene.box.edges = edges;
  scene.box.boundary[2] = Boundary::wall;
  std::uniform_real_distribution<double> uniform(0.05, 0.95);
  for (int n = 0; n < 12; ++n) {
    auto& p = scene.particles;
    p.x.push_back(edges.cwiseProduct(Vec<3>(uniform(scene.random), uniform(scene.random), uniform(scene.random))));
    p.v.push_back(Vec<3>::Zero());
    p.mass.push_back(1 + n % 3);
    p.radius.push_back(0.1);
    p.charge.push_back(n < 6 ? n < 3 ? 2 : 1 : -1.5);
    p.species.push_back(0);
    p.image.push_back({});
  }
  return scene;
}

TEST(Ewald, BetweenWallsItIsTheSumOverImagesAlongThem) {
  for (const auto& [edges, wall_charges] : {std::pair{Vec<3>(4, 4, 4), std::vector{0.0, 0.0}},
                                            {Vec<3>(4, 5, 2), {0.3, -0.3}},
                                            {Vec<3>(4, 3.5, 9), {0.2, -0.6}}}) {
    Scene<3> scene = slab(edges);
    auto& p = scene.particles;
    const double area = edges[0] * edges[1], on_walls = area * (wall_charges[0] + wall_charges[1]);
    p.charge[4] -= on_walls;
    // The energy of particle i at a place moved along an axis, with all others and their images.
    const auto energy_of = [&](Id i, std::size_t axis, long double moved, long double alpha) {
      long double sum = 0;
      for (Id j = 0; j < p.size(); ++j) {
        std::array<long double, 3> d{};
        for (int k = 0; k < 3; ++k) d[static_cast<std::size_t>(k)] = static_cast<long double>(p.x[i][k]) - p.x[j][k];
        if (i != j) d[axis] += moved;
        sum += p.charge[i] * p.charge[j] * slab_pair(edges, d, alpha);
      }
      const long double z = p.x[i][2] + (axis == 2 ? moved : 0);
      const long double in_walls = wall_charges[0] * z + wall_charges[1] * (edges[2] - z);
      return sum - 2 * kPi * p.charge[i] * in_walls;
    };
    // Half of the energy of a charge in the field of the walls belongs to the walls.
    long double exact = -2 * kPi * wall_charges[1] * edges[2] * wall_charges[0] * area, other = 0;
    for (Id i = 0; i < p.size(); ++i)
      exact -= kPi * p.charge[i] * (wall_charges[0] * p.x[i][2] + wall_charges[1] * (edges[2] - p.x[i][2]));
    other = exact;
    std::vector<Vec<3>> force(p.size());
    for (Id i = 0; i < p.size(); ++i) {
      exact += 0.5L * energy_of(i, 0, 0, 0.9L);
      other += 0.5L * energy_of(i, 0, 0, 0.8L);
      for (int k = 0; k < 3; ++k) {
        const auto change = [&](long double h) {
          return energy_of(i, static_cast<std::size_t>(k), h, 0.9L) -
                 energy_of(i, static_cast<std::size_t>(k), -h, 0.9L);
        };
        constexpr long double h = 1e-3L;
        force[i][k] = static_cast<double>(-(8 * change(h) - change(2 * h)) / (12 * h));
      }
    }
    EXPECT_NEAR(static_cast<double>(exact - other), 0, 1e-12);
    double unit = 0;  // from the mean of q²
    for (const double q : p.charge) unit += q * q / 12 / std::pow(edges.prod() / 12, 2.0 / 3);
    for (const double accuracy : {1e-2, 1e-4, 1e-6, 1e-8}) {
      const auto term = ewald_between_walls(scene, accuracy, wall_charges);
      EXPECT_NEAR(energy(*term, p.x), static_cast<double>(exact), 10 * accuracy * unit);
      const auto f = forces(*term, p.x);
      double sum = 0;
      for (Id i = 0; i < p.size(); ++i) sum += (f[i] - force[i]).squaredNorm();
      EXPECT_LE(std::sqrt(sum / 12), accuracy * unit);
      std::cout << edges.transpose() << ", " << accuracy << ": force " << std::sqrt(sum / 12) / unit << ", energy "
                << energy(*term, p.x) - static_cast<double>(exact) << '\n';
    }
  }
}

TEST(Ewald, MeanForcesBetweenWallsDoExactlyTheWork) {
  Scene<3> scene = slab({4, 5, 6});
  const auto& x = scene.particles.x;
  for (const auto& wall_charges : {std::vector{0.0, 0.0}, {0.2, 0.2}}) {
    scene.particles.charge[4] -=
        20 * (wall_charges[0] + wall_charges[1]);  // the field between walls of equal charges is zero
    const auto term = ewald_between_walls(scene, 1e-6, wall_charges);
    for (const double size : {1e-6, 0.01, 0.2}) {
      auto w = scene.random_vectors(size);
      for (auto& each : w) each += Vec<3>(0.3, -0.2, 0.1);
      expect_exact_work(scene, *term, x, displaced(x, w, 1));
    }
  }
}

TEST(Ewald, LeavesOutBondedPairs) {
  Scene<3> scene(40, 6, Boundary::periodic, 0.7);
  for (Id i = 0; i < 40; ++i) scene.particles.charge[i] = i % 2 == 0 ? 1.5 : -1;
  auto& x = scene.particles.x;
  // A triangle, two bonds of one pair, and a bond across the edges, longer than the pair term reaches.
  const PairList bonds = {{0, 1}, {2, 1}, {0, 2}, {1, 0}, {3, 4}};
  x[1] = x[0] + Vec<3>(0.6, 0, 0), x[2] = x[0] + Vec<3>(0.2, 0.8, 0.1), x[3] = {0.3, 0.2, 5.9}, x[4] = {4.3, 4.2, 3.4};
  const std::vector<std::pair<std::string, ParameterValue>> parameters = {
      {"constant", 1.2}, {"form", "ewald"s}, {"accuracy", 1e-9}, {"exclude", "bonded"s}};
  const auto some = scene.make("coulomb", parameters, std::make_shared<BondTable>(bonds));
  const auto all = ewald(scene, 1e-9, "conducting", 1.2);
  auto f = forces(*all, x);
  double v = energy(*all, x);
  for (const auto& [i, j] : {std::pair{0, 1}, {1, 2}, {0, 2}, {3, 4}}) {
    const auto first = static_cast<Id>(i), second = static_cast<Id>(j);
    const Vec<3> d = scene.nearest(x[first] - x[second]);
    const double pair = 1.2 * scene.particles.charge[first] * scene.particles.charge[second] / d.norm();
    v -= pair;
    f[first] -= pair / d.squaredNorm() * d;
    f[second] += pair / d.squaredNorm() * d;
  }
  EXPECT_NEAR(energy(*some, x), v, 1e-12 * std::abs(v));
  const auto found = forces(*some, x);
  for (Id i = 0; i < 40; ++i) EXPECT_LE((found[i] - f[i]).norm(), 1e-7) << i;
  const auto w = scene.random_vectors(0.2);
  expect_exact_work(scene, *some, x, displaced(x, w, 1));
}

TEST(Ewald, MassesInAPeriodicBoxAttractLikeChargesOfTheOtherSign) {
  Scene<3> scene(60, 6, Boundary::periodic, 0.7);
  const auto term = scene.make("gravity", {{"constant", 1.3}, {"form", "ewald"s}, {"accuracy", 1e-6}});
  Scene<3> charges = scene;
  charges.particles.charge = scene.particles.mass;
  const auto same = ewald(charges, 1e-6, "conducting", -1.3);
  const auto& x = scene.particles.x;
  EXPECT_EQ(energy(*term, x), energy(*same, x));
  const auto f = forces(*term, x), g = forces(*same, x);
  for (Id i = 0; i < x.size(); ++i) EXPECT_EQ(f[i], g[i]);
  EXPECT_NE(term->caution().what.find("uniform background of negative mass"), std::string::npos);
  EXPECT_NE(same->caution().what.find("a uniform background neutralises"), std::string::npos);
  // Two masses near each other feel hardly more than each other.
  Scene<3> two(0, 50, Boundary::periodic, 0);
  for (const double place : {24.5, 25.5}) {
    two.particles.x.push_back({place, 25, 25});
    two.particles.v.push_back(Vec<3>::Zero());
    two.particles.mass.push_back(2);
    two.particles.radius.push_back(0.1);
    two.particles.charge.push_back(0);
    two.particles.species.push_back(0);
    two.particles.image.push_back({});
  }
  const auto pull =
      forces(*two.make("gravity", {{"constant", 1.3}, {"form", "ewald"s}, {"accuracy", 1e-8}}), two.particles.x);
  EXPECT_NEAR(pull[0][0], 1.3 * 4, 1e-3);
  EXPECT_EQ(pull[0][0], -pull[1][0]);
}

TEST(Ewald, ASubtractedEvaluationLeavesNothing) {
  Scene<3> scene(40, 6, Boundary::periodic, 0.7);
  const auto term = ewald(scene, 1e-6);
  const auto& x = scene.particles.x;
  const auto first = displaced(x, scene.random_vectors(0.1), 1);
  auto second = first;
  std::vector<char> changed(x.size(), 0);
  changed[3] = 1;
  second[3] += Vec<3>(0.01, 0, 0.02);
  ForceSums<3> corrected(x.size(), test::kQuantum);
  term->add_mean_forces(x, first, corrected);
  term->add_mean_forces(x, first, corrected, changed.data(), -1);
  term->add_mean_forces(x, second, corrected, changed.data());
  const auto again = mean_forces(*ewald(scene, 1e-6), x, second);
  for (Id i = 0; i < x.size(); ++i) EXPECT_EQ(corrected.value(i), again[i]) << i;
}

TEST(Ewald, BitsDoNotDependOnTheOrderOfTheParticles) {
  Scene<3> scene(50, 6, Boundary::periodic, 0.7), other = scene;
  std::ranges::reverse(other.particles.x);
  std::ranges::reverse(other.particles.mass);
  std::ranges::reverse(other.particles.charge);
  const auto one = ewald(scene, 1e-6), two = ewald(other, 1e-6);
  EXPECT_EQ(energy(*one, scene.particles.x), energy(*two, other.particles.x));
}

TEST(Ewald, TheVirialOfCoulombForcesIsTheirEnergy) {
  Scene<3> scene(60, 6, Boundary::periodic, 0.7);
  for (Id i = 0; i < 60; ++i) scene.particles.charge[i] = i % 2 == 0 ? 1 : -1;
  for (const auto& surface : {"conducting"s, "vacuum"s}) {
    const auto sums = test::sums(*ewald(scene, 1e-12, surface), scene.particles.x);
    EXPECT_NEAR(sums.virial.value(), sums.energy.value(), 1e-10 * sums.magnitude.value()) << surface;
  }
}

std::array<double, 12> fluxes(const Interaction<3>& term, const Scene<3>& scene, Positions<3> v) {
  PairFluxes<3> sums;
  term.add_fluxes(scene.particles.x, v, sums);
  std::array<double, 12> all;
  for (std::size_t k = 0; k < 9; ++k) all[k] = sums.stress[k].value();
  for (std::size_t k = 0; k < 3; ++k) all[9 + k] = sums.heat[k].value();
  return all;
}

TEST(Ewald, StressAndHeatFluxDoNotDependOnTheSplit) {
  for (const bool neutral : {true, false}) {
    Scene<3> scene(60, 6, Boundary::periodic, 0.7);
    for (Id i = 0; neutral && i < 60; ++i) scene.particles.charge[i] = i % 2 == 0 ? 1 : -1;
    const auto v = scene.random_vectors(1);
    const auto exact = fluxes(*ewald(scene, 1e-12), scene, v);
    for (const double accuracy : {1e-7, 1e-9, 1e-11}) {
      const auto found = fluxes(*ewald(scene, accuracy), scene, v);
      for (std::size_t k = 0; k < 12; ++k) {
        EXPECT_NEAR(found[k], exact[k], 300 * accuracy) << k << " " << accuracy << " " << neutral;
        EXPECT_GT(std::abs(exact[k]), 1e-3);
      }
    }
  }
}

/// The images of a small neutral cluster in a large box hardly matter.
TEST(Ewald, StressAndHeatFluxOfAClusterAreThoseOfItsPairs) {
  Scene<3> scene(20, 4, Boundary::periodic, 0.5);
  for (Id i = 0; i < 20; ++i) scene.particles.charge[i] = i % 2 == 0 ? 1 : -1;
  scene.box.edges *= 40;
  const auto v = scene.random_vectors(1);
  const auto found = fluxes(*ewald(scene, 1e-9), scene, v);
  scene.box.boundary.fill(Boundary::open);
  const auto pairs = fluxes(*scene.make("coulomb", {{"constant", 1.0}, {"form", "plain"s}}), scene, v);
  for (std::size_t k = 0; k < 12; ++k) EXPECT_NEAR(found[k], pairs[k], 1e-3) << k;
}

TEST(Ewald, TheSurfaceInVacuumSeesUnwrappedPositions) {
  Scene<3> scene(20, 6, Boundary::periodic, 0.7);
  for (Id i = 0; i < 20; ++i) scene.particles.charge[i] = i % 2 == 0 ? 1 : -1;
  const auto term = ewald(scene, 1e-10, "vacuum");
  const double before = energy(*term, scene.particles.x);
  scene.particles.x[3][1] -= 6;  // into the next image, as Box::wrap() does
  scene.particles.image[3][1] += 1;
  EXPECT_NEAR(energy(*term, scene.particles.x), before, 1e-11);
  scene.particles.image[3][1] -= 1;  // a particle that really moved there
  EXPECT_GT(std::abs(energy(*term, scene.particles.x) - before), 0.1);
}

TEST(Ewald, RefusesWhatItCannotDo) {
  const auto refusal = [](const Scene<3>& scene, std::vector<std::pair<std::string, ParameterValue>> more) {
    more.insert(more.begin(), {{"constant", 1.0}, {"form", "ewald"s}});
    try {
      scene.make("coulomb", more);
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return "accepted"s;
  };
  const auto expect = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  Scene<3> scene(10, 6, Boundary::periodic, 0.7);
  expect(refusal(scene, {{"surface", "vacuum"s}}), "the charges add up to 2.5");
  expect(refusal(scene, {{"accuracy", 9e-13}}), "give a number from 1e-12 to 0.1");
  expect(refusal(scene, {{"cutoff", 2.0}}), "from 'accuracy'");
  expect(refusal(scene, {{"exclude", "bonded"s}}), "there are no bonds");
  expect(refusal(scene, {{"species", std::vector{"A"s, "B"s}}}), "give particles that take no part the charge 0");
  expect(refusal(scene, {{"wall_charges", std::vector{0.1, -0.1}}}), "in a box with walls along one axis");
  expect(refusal(Scene<3>(10, 6, Boundary::wall, 0.7), {}), "periodic along all three axes");
  Scene<3> between = slab({4, 4, 4});
  expect(refusal(between, {{"surface", "conducting"s}}), "leave it out between walls");
  const auto term = ewald_between_walls(between, 1e-4);
  auto beyond = between.particles.x;
  beyond[2][2] = 4.01;
  EXPECT_THROW(forces(*term, beyond), Error);
  EXPECT_THROW(energy(*term, beyond), Error);
  between.particles.charge[0] = 1;
  expect(refusal(between, {}),
         "between walls needs a neutral system, but the charges add up to -1 and those on the walls to 0");
  expect(refusal(between, {{"wall_charges", std::vector{0.1, 0.1}}}), "to -1 and those on the walls to 3.2");
  between.box.boundary[2] = Boundary::open;
  expect(refusal(between, {}), "has walls along one of them");
  scene.box.edges[0] = 1e9;
  expect(refusal(scene, {}), "waves");
  std::ranges::fill(scene.particles.charge, 0.0);
  expect(refusal(scene, {}), "finds no charges");
}

}  // namespace
}  // namespace carom::ewald_test
