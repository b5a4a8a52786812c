// SPDX-License-Identifier: BSD-3-Clause
// A moving boundary: a piston heats a gas of hard spheres; its work and the adiabat are printed for comparison.
//
//   ./piston [SPEED]      of the piston; the initial thermal speed is 1. Slower pistons come closer to the adiabat

#include <carom/carom.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <numeric>

namespace {

constexpr std::size_t kSpheres = 500;
constexpr double kLong = 40, kWide = 10;

/// The temperature, initially 1, on the adiabat d ln T = −⅔ Z d ln V of the equation of state of Carnahan and Starling.
/// Centres stay half a diameter from the two walls.
double adiabat(double edge) {
  const auto filled = [](double length) { return kSpheres * std::numbers::pi / 6 / ((length - 1) * kWide * kWide); };
  const auto integral = [](double f) {
    return carom::elementary::log(f) + (4 * f - 3 * f * f) / ((1 - f) * (1 - f));
  };  // ∫ Z df/f
  return carom::elementary::exp(2.0 / 3 * (integral(filled(edge)) - integral(filled(kLong))));
}

class Rows : public carom::Observer<3> {
 public:
  explicit Rows(const carom::Simulation<3>& run) : run_(run) {}
  void thermo(const carom::Snapshot<3>& shot) override {
    const double edge = run_.system().box.lengths(shot.time)[0];
    std::printf("edge %5.2f, temperature %.4f, adiabat %.4f, work %.3f\n", edge, shot.temperature, adiabat(edge),
                run_.statistics().counters.work.value());
  }

 private:
  const carom::Simulation<3>& run_;
};

}  // namespace

int main(int count, char** arguments) {
  const double speed = count > 1 ? std::strtod(arguments[1], nullptr) : 0.05;
  auto system = std::make_unique<carom::System<3>>();
  carom::Box<3>& box = system->box;
  box.edges = {kLong, kWide, kWide};
  box.boundary = {carom::Boundary::wall, carom::Boundary::periodic, carom::Boundary::periodic};
  box.add({.name = "x+", .velocity = speed});
  auto sites = carom::lattice_sites<3>(carom::Lattice::centred, box, kSpheres, 0.5);
  sites.resize(kSpheres);
  for (const auto& x : sites) system->particles.add({.x = x});
  std::vector<carom::Id> all(kSpheres);
  std::iota(all.begin(), all.end(), 0u);
  carom::draw_velocities<3>(system->particles, all, std::vector<double>(kSpheres, 1.0), /*seed*/ 1);

  const double time = 0.5 * kLong / speed;
  carom::Simulation<3> run(std::move(system), "free-flight", {}, {.end_time = time, .thermo_interval = time / 4});
  Rows rows(run);
  run.add(rows);
  run.run();
  const carom::Statistics& s = run.statistics();
  std::printf("energy less work: error %.1e\n", s.max_energy_error / s.energy_reference);
}
