// SPDX-License-Identifier: BSD-3-Clause
// The pressure tensor and the transport coefficients: by hand, against functions of the state, with collisions and
// forces, and against what else a run measures.

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "engine/base/error.h"
#include "engine/run/observable.h"
#include "engine/setup/step_options.h"
#include "tests/support/experiments.h"

namespace carom::transport_test {
namespace {

template <int D>
std::map<std::string, std::vector<double>> columns(const Observable<D>& observable) {
  std::map<std::string, std::vector<double>> all;
  for (const TableColumn& column : observable.table()) all[column.name] = column.values;
  return all;
}

/// A run to `end` with an observable that samples at 0, interval, …
template <int D>
struct Sampled {
  std::unique_ptr<Simulation<D>> run;
  std::unique_ptr<Observable<D>> observable;
  std::map<std::string, std::vector<double>> table;
};

template <int D>
Sampled<D> sampled(std::unique_ptr<System<D>> system, const std::string& integrator, double step, double end,
                   const std::string& name, const Parameters& given) {
  Sampled<D> all;
  all.run = test::make_run<D>(std::move(system), integrator, {.step = step, .end_time = end});
  all.observable = make_observable(name, all.run->system(), given);
  all.run->add(*all.observable);
  all.run->run();
  all.table = columns(*all.observable);
  return all;
}

template <int D>
void expect_tensor_of_hard_spheres(int cells, double eta) {
  const auto fine =
      sampled<D>(test::hard_spheres<D>(cells, eta), "free-flight", 0.5, 20, "pressure_tensor", {{"interval", 0.05}});
  const auto coarse =
      sampled<D>(test::hard_spheres<D>(cells, eta), "free-flight", 0.5, 20, "pressure_tensor", {{"interval", 5.0}});
  const auto& p = fine.table.at("pressure");
  const auto& error = fine.table.at("error_pressure");
  double trace = 0;
  for (std::size_t a = 0; a < D; ++a)
    for (std::size_t b = 0; b < D; ++b) {
      const std::size_t here = D * a + b;
      EXPECT_EQ(fine.table.at("a")[here], a);
      EXPECT_EQ(fine.table.at("b")[here], b);
      EXPECT_NEAR(p[here], p[D * b + a], 1e-12 * p[0]);
      // Between collisions nothing changes: the interval does not matter.
      for (const char* part : {"pressure", "kinetic", "collisions"})
        EXPECT_NEAR(fine.table.at(part)[here], coarse.table.at(part)[here], 1e-11 * p[0]) << part;
      EXPECT_EQ(fine.table.at("forces")[here], 0);
      if (a == b)
        trace += p[here];
      else
        EXPECT_NEAR(p[here], 0, 5 * error[here]);
      EXPECT_LT(error[here], 0.05 * p[0]);
    }
  EXPECT_NEAR(trace / D, fine.run->statistics().mean_pressure, 1e-12 * p[0]);
  EXPECT_GT(fine.table.at("collisions")[0], fine.table.at("kinetic")[0]);
}

TEST(PressureTensor, OfHardDiscs) { expect_tensor_of_hard_spheres<2>(6, 0.4); }
TEST(PressureTensor, OfHardSpheres) { expect_tensor_of_hard_spheres<3>(3, 0.3); }

TEST(PressureTensor, OfAColumnBetweenWallsIsNotThatOfItsRows) {
  // Along axis 0, two spheres bounce between walls; along axis 1 nothing happens.
  auto system = test::make_system<2>({6, 4}, Boundary::wall, {{1, 2}, {5, 2}}, {{1, 0}, {-1, 0}});
  const auto [run, observable, table] =
      sampled<2>(std::move(system), "free-flight", 10, 60, "pressure_tensor", {{"interval", 6.0}});
  const auto& p = table.at("pressure");
  EXPECT_NEAR(table.at("kinetic")[0], 2.0 / 24, 1e-13);
  // From wall to wall a sphere moves 2 and collides twice, in a time of 4: impulses of 2 at a distance of 1 in this
  // time.
  EXPECT_NEAR(table.at("collisions")[0], 2.0 / 4 / 24, 1e-13);
  EXPECT_EQ(p[1], 0);
  EXPECT_EQ(p[2], 0);
  EXPECT_EQ(p[3], 0);
}

/// The discs above are back after a time of 4 each: samples from time 2 on, and the time before them does not count.
TEST(PressureTensor, TimeBeginsAtTheFirstSample) {
  auto run = test::make_run<2>(test::make_system<2>({6, 4}, Boundary::wall, {{1, 2}, {5, 2}}, {{1, 0}, {-1, 0}}),
                               "free-flight", {.step = 10, .end_time = 15});
  const auto observable = make_observable("pressure_tensor", run->system(), {{"interval", 4.0}}, 2);
  run->add(*observable);
  run->run();
  EXPECT_EQ(observable->samples(), 4u);
  const auto table = columns(*observable);
  EXPECT_NEAR(table.at("kinetic")[0], 2.0 / 24, 1e-13);
  EXPECT_NEAR(table.at("collisions")[0], 2.0 / 4 / 24, 1e-13);
}

TEST(PressureTensor, TraceIsThePressureUnderForces) {
  const auto trace = [](const std::string& type, const Parameters& given, bool charged, double* pressure) {
    auto system = test::hard_spheres<3>(3, 0.2);
    if (charged)
      for (Id i = 0; i < system->size(); ++i) system->particles.charge[i] = i % 2 == 0 ? 1 : -1;
    test::add_interaction(*system, type, given);
    const auto [run, observable, table] =
        sampled<3>(std::move(system), "verlet", 1e-7, 2e-7, "pressure_tensor", {{"interval", 1e-7}});
    *pressure = run->statistics().mean_pressure;
    const auto& p = table.at("pressure");
    EXPECT_GT(std::abs(table.at("forces")[0]), 1e-3) << type;
    return (p[0] + p[4] + p[8]) / 3;
  };
  double pressure = 0;
  const double of_pairs =
      trace("lennard-jones", {{"epsilon", 1.0}, {"sigma", 1.0}, {"cutoff", 2.0}, {"tail", true}}, false, &pressure);
  EXPECT_NEAR(of_pairs, pressure, 1e-6);  // positions move by 1e-7
  const double of_waves = trace("coulomb", {{"form", std::string("ewald")}}, true, &pressure);
  EXPECT_NEAR(of_waves, pressure, 1e-6);
}

/// Without collisions and forces all coefficients are known: |x(t) − x(0)|² and the squared integrals are those of
/// straight lines.
TEST(Transport, OfStraightFlights) {
  auto system = test::make_system<2>({50, 50}, Boundary::periodic, {{5, 5}, {5, 20}, {5, 40}},
                                     {{0.3, 0}, {0.1, 0.01}, {0.2, 0.02}});
  system->particles.charge = {2, -2, 2};
  const auto [run, observable, t] =
      sampled<2>(std::move(system), "free-flight", 10, 250, "transport", {{"interval", 1.0}, {"longest", 100.0}});
  std::vector<double> lags;
  for (int k = 0; k <= 16; ++k) lags.push_back(k);
  for (const int spacing : {2, 4, 8})
    for (int k = 9; k <= (spacing == 8 ? 12 : 16); ++k) lags.push_back(spacing * k);
  ASSERT_EQ(t.at("time").size(), lags.size());
  const std::vector<Vec<2>> v = {{0.1, -0.01}, {-0.1, 0}, {0, 0.01}};  // without the drift
  double square = 0, xy = 0, difference = 0;
  Vec<2> heat = Vec<2>::Zero();
  const Vec<2> current = 2 * (v[0] - v[1] + v[2]);
  for (const Vec<2>& each : v) {
    square += each.squaredNorm() / 3;
    xy += each[0] * each[1];
    difference += 0.5 * (each[0] * each[0] - each[1] * each[1]);
    heat += 0.5 * each.squaredNorm() * each;
  }
  const double temperature = 3 * square / (2 * 2), volume = 2500;  // of N − 1 particles
  for (std::size_t row = 0; row < lags.size(); ++row) {
    const auto n = static_cast<int>(lags[row]);
    EXPECT_NEAR(t.at("time")[row], lags[row], 1e-9);
    EXPECT_NEAR(t.at("vacf")[row], square, 1e-12);
    if (n == 0) continue;
    const int spacing = n <= 16 ? 1 : n <= 32 ? 2 : n <= 64 ? 4 : 8, before = n / spacing / 2 * spacing;
    const double rate = 0.5 * (n + before);  // (n² − before²)/2(n − before)
    EXPECT_NEAR(t.at("diffusion")[row], square * rate / 2, 1e-9);
    EXPECT_NEAR(t.at("shear_viscosity")[row], 0.5 * (xy * xy + difference * difference) * rate / (volume * temperature),
                1e-9);
    EXPECT_NEAR(t.at("thermal_conductivity")[row],
                0.5 * heat.squaredNorm() * rate / (volume * temperature * temperature), 1e-9);
    EXPECT_NEAR(t.at("electrical_conductivity")[row], 0.5 * current.squaredNorm() * rate / (volume * temperature),
                1e-9);
  }
}

/// The energy of a pair with a shoulder in a well.
constexpr double kShoulder = 1.2, kWell = 1.5;
double energy_of_steps(double distance) { return distance < kShoulder ? 0.4 : distance < kWell ? -1 : 0; }

/// Σ m x v and Σ e x at the times of the samples, e with half the energy of each bond of a chain and of steps.
template <int D>
struct Moments : Observer<D> {
  Moments(double interval, double stiffness, bool steps) : interval_(interval), stiffness_(stiffness), steps_(steps) {}
  Sampling sampling() const override { return {interval_, 0}; }
  void sample(double /*time*/, const Particles<D>& p) override {
    std::vector<double> all;
    Eigen::Matrix<double, D, D> stress = Eigen::Matrix<double, D, D>::Zero();
    Vec<D> heat = Vec<D>::Zero();
    for (Id i = 0; i < p.size(); ++i) {
      double energy = 0.5 * p.v[i].squaredNorm();
      for (Id j = 0; steps_ && j < p.size(); ++j)
        if (i != j) energy += 0.5 * energy_of_steps((p.x[i] - p.x[j]).norm());
      for (Id j = 0; j < p.size(); ++j)
        if (i == j + 1 || j == i + 1) energy += 0.25 * stiffness_ * std::pow((p.x[i] - p.x[j]).norm() - 1, 2);
      stress += p.x[i] * p.v[i].transpose();
      heat += energy * p.x[i];
    }
    for (int a = 0; a < D; ++a)
      for (int b = 0; b < a; ++b) all.push_back(0.5 * (stress(a, b) + stress(b, a)));
    all.push_back(0.5 * (stress(0, 0) - stress(1, 1)));
    if (D == 3) all.push_back((stress(0, 0) + stress(1, 1) - 2 * stress(D - 1, D - 1)) / std::sqrt(12.0));
    stresses = all.size();
    for (int a = 0; a < D; ++a) all.push_back(heat[a]);
    moments.push_back(all);
  }
  /// The mean of the squared changes from sample a to sample b.
  double change(std::size_t a, std::size_t b, bool heat) const {
    double sum = 0;
    for (std::size_t k = heat ? stresses : 0; k < (heat ? moments[0].size() : stresses); ++k)
      sum += std::pow(moments[b][k] - moments[a][k], 2);
    return sum / static_cast<double>(heat ? D : stresses);
  }
  std::vector<std::vector<double>> moments;
  std::size_t stresses = 0;

 private:
  double interval_, stiffness_;
  bool steps_;
};

/// Runs a cluster that no particle leaves and that no pair joins across the boundary: there Σ m x v and Σ e x are
/// functions of the state, and their changes are the integrals of the fluxes. Returns the relative errors of viscosity
/// and conductivity at the longest lag, which has one origin.
template <int D>
std::array<double, 2> errors_in_cluster(const std::string& integrator, std::size_t samples, double stiffness,
                                        double radius = 0.5, bool steps = false) {
  const double end = stiffness > 0 ? 0.4 : 1.6, interval = end / static_cast<double>(samples);
  auto system = test::hard_spheres<D>(2, 0.3, 5);
  Particles<D>& p = system->particles;
  const Vec<D> middle = Vec<D>::Constant(4.5 * system->box.edges[0]);
  system->box.edges *= 10;
  for (auto& x : p.x) x += middle;
  p.radius.assign(p.size(), radius);
  Vec<D> drift = Vec<D>::Zero();
  for (const auto& v : p.v) drift += v / static_cast<double>(p.size());
  for (auto& v : p.v) v -= drift;
  if (stiffness > 0)
    test::add_interaction(*system, "harmonic-bond", {{"chain", true}, {"stiffness", stiffness}, {"rest_length", 1.0}});
  if (steps)
    add_step<D>(system->box, system->species, system->size(),
                completed("step", step_parameters(),
                          {{"between", std::vector<std::string>{"*", "*"}},
                           {"range", std::vector{kShoulder, kWell}},
                           {"depth", std::vector{-0.4, 1.0}}}));
  auto run = test::make_run<D>(std::move(system), integrator, {.step = 0.00625, .end_time = end});
  const auto transport = make_observable("transport", run->system(), {{"interval", interval}, {"longest", end}});
  Moments<D> moments(interval, stiffness, steps);
  run->add(*transport);
  run->add(moments);
  run->run();
  EXPECT_EQ(run->statistics().counters.sphere_sphere > 5, radius == 0.5 && !(steps && D == 2));
  EXPECT_EQ(run->statistics().counters.steps.entered > 5, steps);
  EXPECT_EQ(moments.moments.size(), samples + 1);
  const auto t = columns(*transport);
  EXPECT_EQ(t.at("time").size(), samples + 1);
  double temperature = 0;
  for (const auto& value : transport->species_values())
    if (value.symbol == "temperature") temperature = value.value;
  const double half = static_cast<double>(samples - samples / 2) * interval;
  const auto relative = [&](const char* name, bool heat) {
    const double rate = (moments.change(0, samples, heat) - moments.change(samples - samples / 2, samples, heat)) /
                        (2 * half * run->system().box.volume() * temperature * (heat ? temperature : 1));
    return t.at(name)[samples] / rate - 1;
  };
  return {relative("shear_viscosity", false), relative("thermal_conductivity", true)};
}

template <int D>
void expect_moments_of_state() {
  for (const std::size_t samples : {1, 2, 7, 16})
    for (const double each : errors_in_cluster<D>("free-flight", samples, 0)) EXPECT_NEAR(each, 0, 1e-9) << samples;
  for (const double each : errors_in_cluster<D>("edda", 16, 0)) EXPECT_NEAR(each, 0, 1e-9);
  for (const std::size_t samples : {1, 2, 7, 16})
    for (const double each : errors_in_cluster<D>("free-flight", samples, 0, 0.5, true))
      EXPECT_NEAR(each, 0, 1e-9) << samples;
  for (const double each : errors_in_cluster<D>("edda", 16, 0, 0.5, true)) EXPECT_NEAR(each, 0, 1e-9);
  // With forces, the trapezoidal rule.
  const auto coarse = errors_in_cluster<D>("edda", 8, 5, 1e-3), fine = errors_in_cluster<D>("edda", 16, 5, 1e-3);
  for (const std::size_t k : {0, 1}) {
    EXPECT_GT(std::abs(coarse[k] / fine[k]), 3.5);  // second order
    EXPECT_LT(std::abs(fine[k]), 0.01);
  }
  const auto colliding = errors_in_cluster<D>("edda", 16, 5);
  EXPECT_LT(std::abs(colliding[0]), 0.02);
}

TEST(Transport, IntegralsOfDiscsAreThoseOfTheState) { expect_moments_of_state<2>(); }
TEST(Transport, IntegralsOfSpheresAreThoseOfTheState) { expect_moments_of_state<3>(); }

TEST(Transport, VelocitiesAtLagZeroHaveTheTemperature) {
  const auto [run, observable, t] = sampled<3>(test::hard_spheres<3>(3, 0.3), "free-flight", 0.5, 20, "transport",
                                               {{"interval", 0.05}, {"longest", 2.0}});
  const double n = static_cast<double>(run->system().size());
  for (const auto& value : observable->species_values())
    if (value.symbol == "temperature") {
      EXPECT_NEAR(t.at("vacf")[0], 3 * value.value * (n - 1) / n, 1e-12);
    }
  EXPECT_LT(t.at("vacf").back(), 0.1 * t.at("vacf")[0]);
}

TEST(Transport, RefusesWhatHasNoCoefficients) {
  const auto error_of = [](System<2>& system, Parameters given = {{"interval", 0.1}}) -> std::string {
    try {
      make_observable("transport", system, std::move(given));
    } catch (const Error& e) {
      EXPECT_EQ(e.failure(), Failure::deck);
      return e.what();
    }
    return {};
  };
  auto system = test::hard_spheres<2>(3, 0.3);
  EXPECT_EQ(error_of(*system), "");
  EXPECT_NE(error_of(*system, {{"interval", 0.1}, {"longest", 0.05}}).find("shorter than the interval"),
            std::string::npos);
  test::set_law<2>(*system, {{"restitution", 0.9}});
  EXPECT_NE(error_of(*system).find("elastic and smooth"), std::string::npos);
  system = test::hard_spheres<2>(3, 0.3);
  system->box.boundary[1] = Boundary::wall;
  EXPECT_NE(error_of(*system).find("axis 1 is not periodic"), std::string::npos);
  system = test::hard_spheres<2>(3, 0.3);
  system->particles.mass[0] = std::numeric_limits<double>::infinity();
  system->particles.v[0].setZero();
  EXPECT_THROW(sampled<2>(std::move(system), "free-flight", 1, 1, "transport", {{"interval", 0.1}}), Error);
}

}  // namespace
}  // namespace carom::transport_test
