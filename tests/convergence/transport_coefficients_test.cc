// SPDX-License-Identifier: BSD-3-Clause
// Diffusion, viscosity and thermal conductivity of hard spheres against Enskog's theory and the literature.
//
// Enskog's values in the order of Sonine polynomials in which they have converged, with the contact value of the
// literature's pressure. Simulated ratios to them are those of Alder, Gass, Wainwright, J. Chem. Phys. 53 (1970) 3813:
// to their errors of a few percent the conductivity has Enskog's value at all densities, and the viscosity has it below
// ρσ³ = 0.6 and rises above it beyond. The diffusion coefficient is Speedy's (Mol. Phys. 62 (1987) 509), whose equation
// describes systems of about 500 spheres.

#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <map>

#include "engine/run/observable.h"
#include "tests/convergence/fluid.h"

namespace carom {
namespace {

constexpr double kPi = std::numbers::pi;

/// Of spheres of diameter 1, mass 1 and temperature 1.
struct Coefficients {
  double diffusion, viscosity, conductivity;
};

Coefficients enskog(double density) {
  const double chi = literature::contact_value<3>(kPi / 6 * density), b = 2 * kPi / 3 * density, y = b * chi;
  const double root = std::sqrt(kPi);
  // 1.01896, 1.01600, 1.02513: all orders over the first one. Chapman, Cowling, The Mathematical Theory of Non-Uniform
  // Gases, 3rd ed., sections 10.21 and 16.3; the second factors with the sums of AGW.
  return {1.01896 * 3 / (8 * root * density * chi), 1.01600 * 5 / (16 * root) * b * (1 / y + 0.8 + 0.7614 * y),
          1.02513 * 75 / (64 * root) * b * (1 / y + 1.2 + 0.7574 * y)};
}

/// Speedy's equation.
double speedy(double density) {
  const double square = density * density;
  return 3 / (8 * std::sqrt(kPi) * density) * (1 - density / 1.09) * (1 + square * (0.4 - 0.83 * square));
}

struct Measured {
  std::map<std::string, SpeciesValue> values;
  double error(const std::string& name) const { return values.at(name).error; }
  double operator[](const std::string& name) const { return values.at(name).value; }
};

/// Coefficients at a lag of so many mean free times, with temperature 1.
Measured measure(double density, std::size_t n, double lag, std::uint64_t collisions, unsigned seed = 1) {
  const double eta = kPi / 6 * density, free_time = 1 / literature::enskog_rate<3>(eta);
  auto run = test::make_run<3>(test::molten<3>(n, eta, seed), "free-flight",
                               {.step = 20 * free_time, .collisions = collisions});
  const auto transport = make_observable(
      "transport", run->system(), {{"interval", 0.5 * free_time}, {"longest", lag * free_time}}, 100 * free_time);
  run->add(*transport);
  run->run();
  Measured all;
  for (const SpeciesValue& each : transport->species_values()) all.values.insert({std::string(each.symbol), each});
  const double root = std::sqrt(all["temperature"]);  // by which all three coefficients scale
  for (const char* name : {"diffusion", "shear_viscosity", "thermal_conductivity"}) {
    all.values.at(name).value /= root;
    all.values.at(name).error /= root;
  }
  const Coefficients e = enskog(density);
  std::cout << "density " << density << ", " << run->system().size() << " spheres, lag " << lag
            << ": D = " << all["diffusion"] << " ± " << all.error("diffusion") << " = "
            << all["diffusion"] / e.diffusion << " ± " << all.error("diffusion") / e.diffusion
            << " Enskog = " << all["diffusion"] / speedy(density) << " Speedy; viscosity " << all["shear_viscosity"]
            << " = " << all["shear_viscosity"] / e.viscosity << " ± " << all.error("shear_viscosity") / e.viscosity
            << " Enskog; conductivity " << all["thermal_conductivity"] << " = "
            << all["thermal_conductivity"] / e.conductivity << " ± "
            << all.error("thermal_conductivity") / e.conductivity << " Enskog" << std::endl;
  return all;
}

void expect(const Measured& all, const std::string& name, double expected, double known, double least_digits) {
  const double error = all.error(name);
  EXPECT_LE(error, least_digits * expected) << name;
  EXPECT_NEAR(all[name], expected, 4 * std::hypot(error, known * expected)) << name;
}

TEST(TransportCoefficients, OfAHalfDenseFluid) {
  const Measured all = measure(0.5, 256, 20, 500000);
  const Coefficients e = enskog(0.5);
  expect(all, "diffusion", speedy(0.5), 0.01, 0.03);
  expect(all, "shear_viscosity", e.viscosity, 0.02, 0.1);
  expect(all, "thermal_conductivity", e.conductivity, 0.02, 0.1);
}

TEST(TransportCoefficientsSlow, OfADiluteGas) {
  const Measured all = measure(0.01, 500, 30, test::slow_collisions(2e7));
  const Coefficients e = enskog(0.01);
  expect(all, "diffusion", e.diffusion, 0.005, 0.01);
  expect(all, "shear_viscosity", e.viscosity, 0.005, 0.02);
  expect(all, "thermal_conductivity", e.conductivity, 0.005, 0.02);
}

TEST(TransportCoefficientsSlow, FromADiluteToADenseFluid) {
  struct {
    double density, lag, viscosity;
  } const states[] = {{0.2, 30, 1.0}, {0.5, 30, 1.0}, {0.8, 60, 1.2}};
  for (const auto& [density, lag, viscosity] : states) {
    const Measured all = measure(density, 500, lag, test::slow_collisions(2e7));
    const Coefficients e = enskog(density);
    expect(all, "diffusion", speedy(density), 0.01, 0.01);
    expect(all, "shear_viscosity", viscosity * e.viscosity, 0.03, 0.03);
    expect(all, "thermal_conductivity", e.conductivity, 0.02, 0.03);
  }
}

}  // namespace
}  // namespace carom
