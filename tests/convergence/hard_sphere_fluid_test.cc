// Hard spheres and discs against the literature: pressure and collision rate.
//
// Error bars are standard errors from blocks of the thermo table. Spheres: Carnahan, Starling, J. Chem. Phys. 51 (1969)
// 635; discs: Henderson, Mol. Phys. 30 (1975) 971, with Luding's correction, Phys. Rev. E 63 (2001) 042201. Collision
// rate: Enskog, with g at contact from the same equations of state (Chapman, Cowling, 1970, section 16.2).

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/experiments.h"

namespace carom {
namespace {

/// Contact value of g(r).
double contact_value(int dimension, double eta) {
  if (dimension == 3) return (1 - eta / 2) / std::pow(1 - eta, 3);
  return (1 - 7 * eta / 16) / std::pow(1 - eta, 2) - std::pow(eta, 3) / 16 / (8 * std::pow(1 - eta, 4));
}

/// pV/(N k T).
double compressibility(int dimension, double eta) {
  return 1 + (dimension == 3 ? 4 : 2) * eta * contact_value(dimension, eta);
}

/// Collisions that one sphere of diameter 1 and mass 1 suffers a unit time at temperature 1.
double enskog_rate(int dimension, double eta) {
  const double pi = std::numbers::pi, density = dimension == 3 ? 6 * eta / pi : 4 * eta / pi;
  return (dimension == 3 ? 4 * std::sqrt(pi) : 2 * std::sqrt(pi)) * density * contact_value(dimension, eta);
}

template <int D>
struct Rows : Observer<D> {
  void thermo(const Snapshot<D>& shot) override {
    pressure.push_back(shot.pressure);
    time.push_back(shot.time);
    collisions.push_back(static_cast<double>(shot.collisions));
  }
  std::vector<double> pressure, time, collisions;
};

struct Mean {
  double value, error;
};

/// Mean and standard error of all but the first fifth, from ten blocks.
Mean blocked_mean(const std::vector<double>& y) {
  const std::size_t first = y.size() / 5, blocks = 10, length = (y.size() - first) / blocks;
  double sum = 0, squares = 0;
  for (std::size_t b = 0; b < blocks; ++b) {
    double mean = 0;
    for (std::size_t k = 0; k < length; ++k) mean += y[first + b * length + k] / static_cast<double>(length);
    sum += mean, squares += mean * mean;
  }
  const double n = blocks, mean = sum / n;
  return {mean, std::sqrt(std::max(0.0, squares / n - mean * mean) / (n - 1))};
}

template <int D>
void expect_literature(int cells, double eta, std::uint64_t collisions) {
  const double epoch = 2 / enskog_rate(D, eta);
  auto run = test::make_run<D>(test::hard_spheres<D>(cells, eta), "free-flight",
                               {.step = 5 * epoch, .collisions = collisions, .thermo_interval = epoch});
  Rows<D> rows;
  run->add(rows);
  run->run();
  const auto& system = run->system();
  const double n = static_cast<double>(system.particles.size()), density = n / system.box.volume();
  rows.pressure.pop_back();  // the last row is cut short
  const Mean p = blocked_mean(rows.pressure);
  const double expected = compressibility(D, eta);
  EXPECT_NEAR(p.value / density, expected, std::max(0.005 * expected, 3 * p.error / density))
      << "packing fraction " << eta << ", standard error " << p.error / density;
  EXPECT_LT(p.error / density, 0.004 * expected);

  std::vector<double> rate;
  for (std::size_t k = 1; k + 1 < rows.time.size(); ++k)
    rate.push_back(2 * (rows.collisions[k] - rows.collisions[k - 1]) / (n * (rows.time[k] - rows.time[k - 1])));
  const Mean r = blocked_mean(rate);
  EXPECT_NEAR(r.value, enskog_rate(D, eta), std::max(0.007 * r.value, 3 * r.error)) << "packing fraction " << eta;

  const auto& s = run->statistics();
  EXPECT_LE(s.max_energy_error, 1e-12 * s.energy_reference);
  EXPECT_LE(s.counters.max_overlap, 1e-12);
  EXPECT_LE(*s.max_momentum_error, 1e-9);
}

TEST(HardSphereFluid, SpheresAtPackingFraction10) { expect_literature<3>(8, 0.10, 200000); }
TEST(HardSphereFluid, SpheresAtPackingFraction30) { expect_literature<3>(8, 0.30, 600000); }
TEST(HardSphereFluid, SpheresAtPackingFraction45) { expect_literature<3>(8, 0.45, 1200000); }
TEST(HardSphereFluid, DiscsAtPackingFraction20) { expect_literature<2>(32, 0.20, 300000); }
TEST(HardSphereFluid, DiscsAtPackingFraction50) { expect_literature<2>(32, 0.50, 800000); }

}  // namespace
}  // namespace carom
