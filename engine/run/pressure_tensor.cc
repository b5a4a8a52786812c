// SPDX-License-Identifier: BSD-3-Clause
// The pressure tensor ⟨S⟩/Ω, S the flux of momentum (fluxes.h).

#include "engine/run/fluxes.h"

namespace carom::observable {
namespace {

/// The means of S/Ω.
template <int D>
class PressureTensor : public Observable<D> {
 public:
  PressureTensor(const System<D>& system, const Parameters& parameters, double start)
      : Observable<D>({parameters.real("interval"), start}), system_(system), fluxes_(system, false) {}

  bool divided() const override { return true; }
  bool needs_contacts() const override { return true; }
  void contacts(double slab_start, std::span<const Contact<D>> contacts) override { fluxes_.add(slab_start, contacts); }

  std::vector<TableColumn> table() const override {
    std::vector<TableColumn> table = {{"a", {}}, {"b", {}}};
    for (int a = 0; a < D; ++a)
      for (int b = 0; b < D; ++b) table[0].values.push_back(a), table[1].values.push_back(b);
    for (std::size_t part = 0; part < kParts.size(); ++part) {
      std::vector<double> means;
      std::vector<Estimate> estimates;
      constexpr std::size_t kComponents = std::size_t{D} * D;
      for (std::size_t k = 0; k < kComponents; ++k) {
        estimates.push_back(estimate(kComponents * part + k));
        means.push_back(estimates.back().mean);
      }
      add_estimates(table, kParts[part], means, estimates);
    }
    return table;
  }
  std::vector<SpeciesValue> species_values() const override {
    static constexpr std::array<std::array<std::string_view, 3>, 3> names = {
        {{"xx", "xy", "xz"}, {"yx", "yy", "yz"}, {"zx", "zy", "zz"}}};
    std::vector<SpeciesValue> values;
    for (int a = 0; a < D; ++a)
      for (int b = 0; b < D; ++b) {
        const Estimate e = estimate(D * a + b);
        values.push_back({"pressure_tensor", {}, names[a][b], e.mean, e.error});
      }
    return values;
  }

 private:
  static constexpr std::array kParts = {"pressure", "kinetic", "collisions", "forces"};

  Estimate estimate(std::size_t column) const { return series_.columns() > 0 ? series_.estimate(column) : Estimate{}; }
  void add_sample(double time, const Particles<D>& particles) override {
    const std::vector<Traveller<D>> all = travellers(system_, particles);
    const Fluxes<D> sum = fluxes_.to(time, particles, all);
    if (this->samples() > 0 && !all.empty()) {
      const Tensor<D> parts[] = {sum.kinetic + sum.contacts + sum.forces, sum.kinetic, sum.contacts, sum.forces};
      if (series_.columns() == 0) series_ = Blocking(std::size_t{D} * D * kParts.size());
      std::vector<double> values;
      for (const Tensor<D>& part : parts)
        for (int a = 0; a < D; ++a)
          for (int b = 0; b < D; ++b) values.push_back(part(a, b) / system_.box.volume());
      const double elapsed = time - before_;
      series_.add(values, {&elapsed, 1});
    }
    before_ = time;
  }
  void sums(Archive& archive) override { archive(fluxes_, before_, series_); }

  const System<D>& system_;
  FluxIntegral<D> fluxes_;
  double before_ = 0;  // the last sample
  Blocking series_;    // of the parts; the weights are the times
};

template <int D>
std::optional<ParameterError> complete_pressure_tensor(Parameters&, const System<D>& system) {
  if (system.box.plain()) return {};
  return ParameterError{"interval",
                        "the pressure tensor needs a constant volume, and walls of this box move or divide it",
                        "set pressure_tensor_interval = 0"};
}

}  // namespace

ObservableInfo pressure_tensor() {
  return {
      .name = "pressure_tensor",
      .title = "pressure tensor",
      .parameters = {parameter::interval("simulated time between samples of the pressure tensor, averaged into "
                                         "pressure_tensor.csv; 0: none. Collisions "
                                         "between samples are all counted; with forces give a few steps")},
      .documentation =
          "The mean of (sum m v v + sum d F + sum d J/t)/V over particles, pairs and collisions, d the separation, F "
          "the force and J the impulse; a force of more than two particles is refused unless its tensor is known (the "
          "waves of ewald). Columns: a and b (the axes), pressure, its parts kinetic, collisions and forces, and "
          "error_ and "
          "samples_ of each. Between collisions in free flight the integral over time is exact; with forces it is a "
          "trapezoidal sum over samples. Contacts at rest are not counted, as in the pressure of thermo.csv.",
      .source = "Allen, Tildesley, Computer Simulation of Liquids, 2nd ed., section 2.7",
      .in_2d = maker<PressureTensor, 2>(complete_pressure_tensor<2>),
      .in_3d = maker<PressureTensor, 3>(complete_pressure_tensor<3>),
      .sheared = true};
}

}  // namespace carom::observable
