// SPDX-License-Identifier: BSD-3-Clause
// Large cold cations and small hot anions under edda: energy is conserved to rounding through the collisions, the
// species reach one temperature, and g(r) at contact is that of psa with a tiny step from the same start.
//
// Error bars are standard errors from 20 blocks after an equilibration of a fifth of the run. With 19 degrees of
// freedom |t| > 5 has a probability of 8e-5.

#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <numbers>

#include "engine/run/radial_distribution.h"
#include "engine/setup/placement.h"
#include "tests/convergence/fluid.h"

namespace carom::charged_mixture_test {
namespace {

using test::Mean;

constexpr double cold = 0.5, hot = 1.5;

/// 54 ions of each kind, charges 1 and −1, diameters 1 and 0.5, masses 1 and 0.25, packing fraction 0.35: randomly
/// assigned to fcc sites.
std::unique_ptr<System<3>> charged_mixture(unsigned seed) {
  const std::size_t n = 108;
  const double volume = n / 2 * std::numbers::pi / 6 * (1 + 0.125) / 0.35;
  Box<3> box;
  box.edges = commensurate_edges<3>(Lattice::centred, n, volume);
  box.boundary.fill(Boundary::periodic);
  const std::vector<std::size_t> halves(2, n / 2);
  const auto owner = distribute(n, halves, seed);
  std::vector<double> radius(n), mass(n), temperature(n);
  std::vector<Id> all(n);
  for (Id i = 0; i < n; ++i) {
    const bool anion = owner[i] == 1;
    all[i] = i, radius[i] = anion ? 0.25 : 0.5, mass[i] = anion ? 0.25 : 1, temperature[i] = anion ? hot : cold;
  }
  auto system = test::make_system<3>(box.edges, Boundary::periodic, lattice_sites<3>(Lattice::centred, box, n, 0.0),
                                     std::vector<Vec<3>>(n, Vec<3>::Zero()), radius, mass);
  system->species = {"cation", "anion"};
  for (Id i = 0; i < n; ++i) {
    system->particles.species[i] = static_cast<std::uint16_t>(owner[i]);
    system->particles.charge[i] = owner[i] == 1 ? -1 : 1;
  }
  draw_velocities<3>(system->particles, all, temperature, seed);
  test::add_interaction(
      *system, "coulomb",
      {{"constant", 1.0}, {"form", std::string("damped-shifted")}, {"damping", 1.0}, {"cutoff", 1.6}});
  return system;
}

/// The temperatures of both species. The total momentum is zero, so the mean of m v² is 3kT(1 − m/M).
std::array<double, 2> temperatures(const Particles<3>& p) {
  double whole = 0;
  for (const double m : p.mass) whole += m;
  std::array<double, 2> energy{}, freedom{};
  for (std::size_t i = 0; i < p.size(); ++i) {
    energy[p.species[i]] += p.mass[i] * p.v[i].squaredNorm();
    freedom[p.species[i]] += 3 * (1 - p.mass[i] / whole);
  }
  return {energy[0] / freedom[0], energy[1] / freedom[1]};
}

/// Computes g at contact between unlike ions for each block, and the difference of the temperatures for each sample.
class Blocks : public Observer<3> {
 public:
  static constexpr int number = 20;
  static constexpr double interval = 0.02;

  Blocks(const System<3>& system, double end_time)
      : start_(end_time / 5), length_((end_time - start_) / number), first_(temperatures(system.particles)) {
    // Contact, at 0.75, is a boundary between shells.
    const RadialDistributionOptions options = {.sampling = sampling(), .range = 2.1, .bins = 84};
    for (int b = 0; b < number; ++b) blocks_.emplace_back(system, options);
  }
  Sampling sampling() const override { return {.interval = interval, .start = start_}; }
  void sample(double time, const Particles<3>& particles) override {
    blocks_[std::min(static_cast<int>((time - start_) / length_), number - 1)].sample(time, particles);
    const auto t = temperatures(particles);
    difference_.push_back(t[1] - t[0]);
  }
  double difference_at_start() const { return first_[1] - first_[0]; }
  Mean difference() const { return test::blocked_mean(difference_, 0, number); }
  Mean contact_value() const {
    std::vector<double> values;
    for (const auto& block : blocks_) values.push_back(block.contact_value(0, 1).value());
    return test::blocked_mean(values, 0, number);
  }

 private:
  double start_, length_;
  std::array<double, 2> first_;
  std::vector<RadialDistribution<3>> blocks_;
  std::vector<double> difference_;
};

/// The results of one run of the mixture.
struct Measured {
  Mean difference, contact_value;
  double difference_at_start;
  Statistics statistics;
};

Measured measure(const char* method, double step, double end_time) {
  auto run = test::make_run<3>(charged_mixture(1), method, {.step = step, .end_time = end_time});
  Blocks blocks(run->system(), end_time);
  run->add(blocks);
  run->run();
  return {blocks.difference(), blocks.contact_value(), blocks.difference_at_start(), run->statistics()};
}

/// psa runs for a fraction `share` of the time at step `tiny`. `largest_error` limits the error bars (of g: the
/// relative ones), so that the comparison is meaningful.
void expect_equilibrium(std::uint64_t collisions, double share, double tiny, double largest_error) {
  const double end_time = static_cast<double>(collisions) / 1000;  // a unit of time has slightly more
  const auto edda = measure("edda", 0.02, end_time), psa = measure("psa", tiny, share * end_time);
  for (const auto* m : {&edda, &psa})
    std::cout << m->statistics.counters.sphere_sphere << " collisions: relative energy error "
              << m->statistics.max_energy_error / m->statistics.energy_reference << "; temperature of the anions less "
              << "that of the cations " << m->difference_at_start << " at the start, later " << m->difference.value
              << " ± " << m->difference.error << "; g at contact " << m->contact_value.value << " ± "
              << m->contact_value.error << '\n';
  const auto& s = edda.statistics;
  EXPECT_GE(s.counters.sphere_sphere, collisions);
  EXPECT_LE(s.max_energy_error, 1e-12 * s.energy_reference);
  EXPECT_LE(s.counters.max_overlap, 1e-12);
  EXPECT_GT(edda.difference_at_start, 0.5);
  EXPECT_LE(edda.difference.error, largest_error);
  EXPECT_NEAR(edda.difference.value, 0, 5 * edda.difference.error);
  const double error = std::hypot(edda.contact_value.error, psa.contact_value.error);
  EXPECT_LE(error, largest_error * psa.contact_value.value);
  EXPECT_NEAR(edda.contact_value.value, psa.contact_value.value, 5 * error);
}

TEST(ChargedMixture, ComesToEquilibrium) { expect_equilibrium(3000, 1, 0.002, 0.1); }
TEST(ChargedMixtureSlow, ComesToEquilibrium) { expect_equilibrium(test::slow_collisions(1e6), 0.25, 0.001, 0.01); }

}  // namespace
}  // namespace carom::charged_mixture_test
