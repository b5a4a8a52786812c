// SPDX-License-Identifier: BSD-3-Clause
// A user-defined potential: the Gaussian core, V = ε e^{−(r/σ)²}, in a fluid of soft particles with small hard cores.
//
//   ./own_potential           edda conserves the energy, which needs all four functions; psa does so to its order

#include <carom/carom.h>

#include <cmath>
#include <cstdio>

namespace {

class GaussianCore {
 public:
  GaussianCore(double epsilon, double sigma) : epsilon_(epsilon), width_(1 / (sigma * sigma)) {}

  carom::ForceScale scale(double) const { return {epsilon_ * std::sqrt(width_), epsilon_}; }

  template <class T>
  T value(T rho) const {
    return epsilon_ * carom::elementary::exp(-width_ * rho);
  }
  template <class T>
  T derivative(T rho) const {
    return -width_ * value(rho);
  }
  template <class T>
  T second_derivative(T rho) const {
    return width_ * width_ * value(rho);
  }
  template <class T>
  T quotient(T rho_old, T rho_new) const {  // V(b) (e^{−x} − 1)/(a − b), x = (a − b)/σ², b the smaller
    const T lower = carom::elementary::min(rho_old, rho_new), upper = carom::elementary::max(rho_old, rho_new);
    const T x = width_ * (upper - lower);
    return width_ * value(lower) * (x > 0 ? carom::elementary::expm1(-x) / x : carom::all<T>(-1));
  }

 private:
  double epsilon_, width_;  // V(0) [energy], 1/σ² [1/length²]
};

template <int D>
std::unique_ptr<carom::Interaction<D>> make(const carom::Parameters& p, const carom::InteractionContext<D>& context) {
  return carom::options::pair_term<D>("gaussian-core", GaussianCore(p.real("epsilon"), p.real("sigma")),
                                      carom::PairWeight::one, p, context);
}

carom::InteractionInfo gaussian_core() {
  using enum carom::Parameter::Type;
  return {.name = "gaussian-core",
          .kind = carom::InteractionInfo::Kind::pair,
          .parameters = carom::options::with_pair_options(
              {{"epsilon", real, "", "energy", "V at r = 0"},
               {"sigma", real, "", "length", "width", carom::Parameter::Range::positive}}),
          .formula = "sum over pairs of eps exp(-(r/sigma)^2)",
          .documentation = "Polymer coils, each a soft particle.",
          .source = "Stillinger, J. Chem. Phys. 65 (1976) 3968",
          .in_2d = make<2>,
          .in_3d = make<3>};
}

std::unique_ptr<carom::System<3>> coils() {
  auto system = std::make_unique<carom::System<3>>();
  system->box.edges.setConstant(6);
  system->box.boundary.fill(carom::Boundary::periodic);
  std::vector<carom::Id> all;
  for (const auto& x : carom::lattice_sites<3>(carom::Lattice::centred, system->box, 108, 0)) {
    all.push_back(static_cast<carom::Id>(all.size()));
    system->particles.add({.x = x, .radius = 0.2});
  }
  carom::draw_velocities<3>(system->particles, all, std::vector<double>(all.size(), 1.0), /*seed*/ 1);
  add_interaction(*system, gaussian_core(), {{"epsilon", 2.0}, {"sigma", 1.0}, {"cutoff", 3.0}});
  return system;
}

}  // namespace

int main() {
  for (const double step : {0.02, 0.01})
    for (const char* method : {"edda", "psa"}) {
      carom::Simulation<3> run(coils(), method, {{"step", step}}, {.end_time = 2});
      run.run();
      const carom::Statistics& s = run.statistics();
      std::printf("%s, step %.2f: energy error %.1e, pressure %.2f\n", method, step,
                  s.max_energy_error / s.energy_reference, s.mean_pressure);
    }
}
