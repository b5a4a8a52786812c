// SPDX-License-Identifier: BSD-3-Clause
// Densities and temperature in slabs across one axis.
//
// If a sample finds n particles (by their centres) with kinetic energy K in a slab of volume V, the density is ⟨n⟩/V
// and the temperature 2⟨K⟩/(D⟨n⟩), without fixed particles; the mean velocity is not subtracted. Sums are exact, so
// that their order does not matter.

#include <algorithm>
#include <limits>

#include "engine/run/observable.h"

namespace carom::observable {
namespace {

template <int D>
class TemperatureProfile : public Observable<D> {
 public:
  TemperatureProfile(const System<D>& system, const Parameters& parameters, double start)
      : Observable<D>({parameters.real("interval"), start}),
        box_(system.box),
        axis_(parameters.integer("axis")),
        number_(static_cast<std::size_t>(parameters.integer("bins"))),
        moving_(number_.size()),
        twice_kinetic_(number_.size()),
        species_(system.species),
        series_((2 + parts()) * number_.size()) {}

  std::vector<TableColumn> table() const override {
    const auto bins = static_cast<double>(number_.size()), samples = static_cast<double>(this->samples());
    std::vector<TableColumn> table = {{"x", {}}};
    const auto density = [&](std::size_t first) {
      std::vector<Estimate> estimates;
      estimates.reserve(number_.size());
      for (std::size_t b = 0; b < number_.size(); ++b) {
        estimates.push_back(series_.estimate(first + b));
        estimates.back().error /= box_.volume() / bins;
      }
      return estimates;
    };
    std::vector<double> all, temperature;
    std::vector<Estimate> of_temperature;
    for (std::size_t b = 0; b < number_.size(); ++b) {
      table[0].values.push_back((static_cast<double>(b) + 0.5) * box_.edges[axis_] / bins);
      all.push_back(number_[b] / (samples * box_.volume() / bins));
      temperature.push_back(moving_[b] > 0 ? twice_kinetic_[b].value() / (D * moving_[b])
                                           : std::numeric_limits<double>::quiet_NaN());
      of_temperature.push_back(series_.estimate(number_.size() + b));
    }
    add_estimates(table, "density", all, density(0));
    add_estimates(table, "temperature", temperature, of_temperature);
    for (std::size_t s = 0; s < parts(); ++s) {
      const std::vector<Estimate> estimates = density((2 + s) * number_.size());
      std::vector<double> of_species;
      of_species.reserve(estimates.size());
      for (const Estimate& each : estimates) of_species.push_back(each.mean / (box_.volume() / bins));
      add_estimates(table, "density_" + species_[s], of_species, estimates);
    }
    return table;
  }

 private:
  /// The number of species, each of which has a density of its own; 0 if there is only one.
  std::size_t parts() const { return species_.size() > 1 ? species_.size() : 0; }

  void add_sample(double /*time*/, const Particles<D>& p) override {
    const std::size_t bins = number_.size();
    std::vector<ExactSum> twice_kinetic(bins);
    std::vector<double> values(series_.columns()), weights(series_.columns(), 1.0);
    std::fill_n(weights.begin() + static_cast<std::ptrdiff_t>(bins), bins, 0.0);
    for (std::size_t i = 0; i < p.size(); ++i) {
      const auto all = static_cast<double>(bins);
      const auto slab = static_cast<std::size_t>(std::clamp(p.x[i][axis_] / box_.edges[axis_] * all, 0.0, all - 1));
      values[slab] += 1;
      if (parts() > 0) values[(2 + p.species[i]) * bins + slab] += 1;
      if (p.fixed(static_cast<Id>(i))) continue;
      moving_[slab] += 1;
      weights[bins + slab] += D;
      twice_kinetic[slab].add(p.mass[i] * p.v[i].squaredNorm());
    }
    for (std::size_t b = 0; b < bins; ++b) {
      number_[b] += values[b];
      values[bins + b] = twice_kinetic[b].value();
      twice_kinetic_[b].add(twice_kinetic[b]);
    }
    series_.add(values, weights);
  }

  void sums(Archive& archive) override { archive(number_, moving_, twice_kinetic_, series_); }

  const Box<D>& box_;
  Eigen::Index axis_;
  std::vector<double> number_, moving_;  // particles in each slab, and those not fixed, summed over all samples
  std::vector<ExactSum> twice_kinetic_;
  std::vector<std::string> species_;
  Blocking series_;  // of the numbers in all slabs, then of the temperatures, then of the numbers of each species
};

template <int D>
std::optional<ParameterError> complete_profile(Parameters& parameters, const System<D>& system) {
  if (parameters.integer("axis") >= D)
    return ParameterError{"axis", "there is no such axis", "the axes are numbered from 0"};
  if (system.box.closed() && system.box.plain()) return {};
  return ParameterError{
      "interval", "a profile needs slabs, and a box with an open boundary, walls that move or further walls has none",
      "set profile_interval = 0, or close the box"};
}

}  // namespace

ObservableInfo profile() {
  using enum Parameter::Type;
  return {
      .name = "profile",
      .title = "densities and temperature across the box",
      .parameters = {parameter::interval("simulated time between samples of the profile of density and temperature, "
                                         "averaged into profile.csv; 0: none"),
                     {.name = "bins",
                      .type = integer,
                      .fallback = "50",
                      .unit = "-",
                      .meaning = "slabs of equal thickness",
                      .range = Parameter::Range::positive,
                      .most = 1e5},
                     {.name = "axis",
                      .type = integer,
                      .fallback = "0",
                      .unit = "-",
                      .meaning = "the axis, counted from 0, that is normal to the slabs",
                      .range = Parameter::Range::non_negative}},
      .documentation =
          "Columns: x (middle of a slab), density (of centres), temperature 2K/(D n) of the n particles in the slab, "
          "their mean velocity is not subtracted; with several species density_A of each; error_ and samples_ of all.",
      .source = "Allen, Tildesley, Computer Simulation of Liquids, 2nd ed., section 2.12",
      .in_2d = maker<TemperatureProfile, 2>(complete_profile<2>),
      .in_3d = maker<TemperatureProfile, 3>(complete_profile<3>)};
}

}  // namespace carom::observable
