// SPDX-License-Identifier: BSD-3-Clause
// A user-defined integrator: Euler–Cromer (symplectic Euler) with hard collisions, compared with psa.
//
//   ./own_integrator          v += h a(x), then all spheres move straight for h and collide event by event: order 1

#include <carom/carom.h>

#include <cstdio>
#include <optional>

namespace {

template <int D>
class EulerCromer : public carom::Integrator<D> {
 public:
  explicit EulerCromer(const carom::Parameters& parameters)
      : max_events_(static_cast<std::uint64_t>(parameters.integer("max_events_per_step"))) {}

  void start(carom::System<D>& system, carom::Counters&) override { core_.emplace(system, max_events_); }

  void slab(carom::System<D>& system, const carom::Slab& slab, carom::SlabReport<D>& report) override {
    auto& p = system.particles;
    force_.resize(p.size());
    carom::evaluate_forces<D>(system, p.x, force_, report.counters);
    for (carom::Id i = 0; i < p.size(); ++i) p.v[i] += (slab.length / p.mass[i]) * force_[i];
    core_->begin_step(report.counters, report.contacts, &force_, slab.length);
    core_->begin(p.v, {}, slab.length);  // straight flights
    core_->fly({});
    core_->commit(0);
    core_->finish(p);
    system.wrap();
    report.reached = slab.length;
  }

 private:
  std::uint64_t max_events_;
  std::optional<carom::SlabCore<D>> core_;
  std::vector<carom::Vec<D>> force_;
};

carom::IntegratorInfo euler_cromer() {
  return {.name = "euler-cromer",
          .title = "Euler–Cromer with collisions",
          .order = "1",
          .conserves = "linear momentum",
          .parameters = {carom::parameter::step(), carom::parameter::max_events_per_step()},
          .documentation = "A kick by the forces at the start, then straight flights.",
          .source = "Cromer, Am. J. Phys. 49 (1981) 455",
          .in_2d = [](const carom::Parameters& p) -> std::unique_ptr<carom::Integrator<2>> {
            return std::make_unique<EulerCromer<2>>(p);
          },
          .in_3d = [](const carom::Parameters& p) -> std::unique_ptr<carom::Integrator<3>> {
            return std::make_unique<EulerCromer<3>>(p);
          }};
}

std::unique_ptr<carom::System<2>> two_springs() {
  auto system = std::make_unique<carom::System<2>>();
  system->box.edges = {8, 6};
  for (int k = 0; k < 3; ++k) system->particles.add({.x = {2.0 + 2 * k, 3.0}, .v = {0.3 * k, -0.2}});
  add_interaction(*system, "harmonic-bond", {{"chain", true}, {"stiffness", 1.0}, {"rest_length", 2.0}});
  return system;
}

double energy_error(const carom::Statistics& s) { return s.max_energy_error / s.energy_reference; }

}  // namespace

int main() {
  const carom::IntegratorInfo mine = euler_cromer();
  for (const double step : {0.02, 0.01, 0.005}) {
    carom::Simulation<2> run(two_springs(), mine, {{"step", step}}, {.end_time = 5});
    run.run();
    carom::Simulation<2> other(two_springs(), "psa", {{"step", step}}, {.end_time = 5});
    other.run();
    std::printf("step %.3f: energy error %.1e, psa %.1e\n", step, energy_error(run.statistics()),
                energy_error(other.statistics()));
  }
}
