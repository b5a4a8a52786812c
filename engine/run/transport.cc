// SPDX-License-Identifier: BSD-3-Clause
// Diffusion, shear viscosity, thermal and electrical conductivity by Einstein and Helfand (Alder, Gass, Wainwright, J.
// Chem. Phys. 53 (1970) 3813), from particles and from the fluxes S and Q of momentum and energy (fluxes.h); T is in
// units of energy:
//
//   ⟨|x(t) − x(0)|²⟩ → 2 D t times the diffusion coefficient in D dimensions,
//   ⟨(∫S_xy dt)²⟩ → 2 t Ω T η,   ⟨(∫Q_x dt)²⟩ → 2 t Ω T² λ,   ⟨(Σ q x(t) − Σ q x(0))²⟩ → 2 t Ω T σ.
//
// The lags are those of a multiple-tau correlator with 16 values a level and intervals that double from level to level
// (Ramírez, Sukumaran, Vorselaars, Likhtman, J. Chem. Phys. 133 (2010) 154103): 0 … 16, 18 … 32, 36 … 64 … intervals.
// Velocities are averaged over the interval of their level, as in that paper. Integrals and positions are not averaged,
// so their differences are exact at all lags. A running coefficient is the rate between half a lag and the lag: its
// deviation decays as the correlations do, whereas the deviation of ⟨(∫S dt)²⟩/2t decays as 1/t.

#include "engine/ranks/step_account.h"
#include "engine/run/fluxes.h"

namespace carom::observable {
namespace {

constexpr std::size_t kLags = 16;   // values of a level; the next level has intervals twice as long
constexpr double kIntervals = 100;  // the longest lag, unless it is given

/// Mean squared integrals and displacements, and velocity autocorrelations.
template <int D>
class Transport : public Observable<D> {
 public:
  Transport(const System<D>& system, const Parameters& parameters, double start)
      : Observable<D>({parameters.real("interval"), start}),
        system_(system),
        longest_(parameters.real("longest")),
        fluxes_(system, true) {}

  bool divided() const override { return true; }
  bool needs_contacts() const override { return true; }
  void contacts(double slab_start, std::span<const Contact<D>> contacts) override { fluxes_.add(slab_start, contacts); }

  std::vector<TableColumn> table() const override {
    std::vector<TableColumn> table = {{"time", {}}};
    const auto add = [&](const std::string& name, std::size_t quantity, double scale) {
      std::vector<double> means;
      std::vector<Estimate> estimates;
      for_each_row([&](const Level& level, std::size_t lag) {
        estimates.push_back(estimate(level, lag, quantity, scale));
        means.push_back(estimates.back().mean);
      });
      add_estimates(table, name, means, estimates);
    };
    for_each_row(
        [&](const Level& level, std::size_t lag) { table[0].values.push_back(estimate(level, lag, kTime, 1).mean); });
    add("vacf", kSingle, 1);
    add("diffusion", kSingle + 1, 1);
    for (std::size_t s = 0; number_.size() > 1 && s < number_.size(); ++s) {
      add("vacf_" + system_.species[s], kSingle + 2 * (s + 1), 1);
      add("diffusion_" + system_.species[s], kSingle + 2 * (s + 1) + 1, 1);
    }
    add("shear_viscosity", kShear, viscosity_scale());
    if (conducts()) add("thermal_conductivity", kHeat, viscosity_scale() / temperature());
    if (charged_) add("electrical_conductivity", kCurrent, viscosity_scale());
    return table;
  }

  std::vector<SpeciesValue> species_values() const override {
    const Level* last = nullptr;
    std::size_t at = 0;
    for_each_row([&](const Level& level, std::size_t lag) {
      if (lag > 0) last = &level, at = lag;
    });
    if (!last) return {};
    std::vector<SpeciesValue> values = {{"transport", {}, "lag", estimate(*last, at, kTime, 1).mean},
                                        {"transport", {}, "temperature", temperature()}};
    const auto add = [&](std::string_view name, std::size_t quantity, double scale) {
      const Estimate e = estimate(*last, at, quantity, scale);
      values.push_back({"transport", {}, name, e.mean, e.error});
    };
    add("diffusion", kSingle + 1, 1);
    add("shear_viscosity", kShear, viscosity_scale());
    if (conducts()) add("thermal_conductivity", kHeat, viscosity_scale() / temperature());
    if (charged_) add("electrical_conductivity", kCurrent, viscosity_scale());
    return values;
  }

 private:
  enum : std::size_t {
    kTime,
    kShear,
    kHeat,
    kCurrent,
    kSingle
  };  // quantities; then the vacf and D of all, of each species

  /// The last values of a level, in rings, and the series of what they give.
  struct Level {
    std::uint64_t count = 0;        // values so far
    std::vector<double> time;       // of the rings
    std::vector<double> integrals;  // of the stress, of the heat flux, of the electric current
    std::vector<Vec<D>> x, v;
    Blocking series;  // [lag][quantity]
    void archive(Archive& archive) { archive(count, time, integrals, x, v, series); }
  };
  static constexpr std::size_t kRing = kLags + 1;
  static constexpr std::size_t kStresses = D * (D + 1) / 2 - 1, kIntegrals = kStresses + D + D;

  std::size_t quantities() const { return kSingle + 2 * (number_.size() > 1 ? number_.size() + 1 : 1); }
  bool conducts() const { return number_.size() == 1 && alike_; }
  double temperature() const { return temperatures_ / static_cast<double>(this->samples()); }
  double viscosity_scale() const { return 1 / (system_.box.volume() * temperature()); }
  static std::size_t first_lag(std::size_t level) { return level == 0 ? 0 : kLags / 2 + 1; }
  /// The largest lag of a level.
  std::size_t last_lag(std::size_t level) const {
    const double intervals = longest_ / this->sampling().interval * (1 + 1e-9);  // the quotient may be rounded down
    return static_cast<std::size_t>(
        std::min(static_cast<double>(kLags), std::ldexp(intervals, -static_cast<int>(level))));
  }
  Estimate estimate(const Level& level, std::size_t lag, std::size_t quantity, double scale) const {
    Estimate e = level.series.estimate(lag * quantities() + quantity);
    e.mean *= scale;
    e.error *= scale;
    return e;
  }
  void for_each_row(auto&& visit) const {
    for (std::size_t n = 0; n < levels_.size(); ++n)
      for (std::size_t lag = first_lag(n); lag <= last_lag(n) && lag < levels_[n].count; ++lag) visit(levels_[n], lag);
  }

  void add_sample(double time, const Particles<D>& particles) override {
    if (this->samples() == 0 && system_.has_fixed())
      throw Error(Failure::deck,
                  "transport needs a conserved momentum, and fixed particles take it; set "
                  "transport_interval = 0");
    const std::vector<Traveller<D>> all = travellers(system_, particles);
    if (this->samples() == 0) fluxes_.add_steps(step_energies(system_, particles));
    const Fluxes<D> sum = fluxes_.to(time, particles, all);
    if (all.empty()) return;
    if (this->samples() == 0) {
      number_.resize(system_.species.size());
      for (const Traveller<D>& each : all) {
        number_[each.species] += 1;
        species_.push_back(each.species);
        alike_ &= each.mass == all[0].mass && std::abs(each.charge) == std::abs(all[0].charge);
        charged_ |= each.charge != 0;
      }
      integrals_.resize(kIntegrals);
    }
    const Tensor<D> s = sum.kinetic + sum.contacts + sum.forces;
    std::size_t k = 0;
    for (int a = 0; a < D; ++a)
      for (int b = 0; b < a; ++b) integrals_[k++] += 0.5 * (s(a, b) + s(b, a));
    integrals_[k++] += 0.5 * (s(0, 0) - s(1, 1));
    if constexpr (D == 3) integrals_[k++] += (s(0, 0) + s(1, 1) - 2 * s(2, 2)) / std::sqrt(12.0);
    for (int a = 0; a < D; ++a) integrals_[k++] += sum.heat[a];

    double* const dipole = &integrals_[k];
    std::fill_n(dipole, D, 0.0);
    double twice_kinetic = 0;
    std::vector<Vec<D>> x, v;
    for (const Traveller<D>& each : all) {
      x.push_back(each.x - time * fluxes_.drift());
      v.push_back(each.v - fluxes_.drift());
      twice_kinetic += each.mass * v.back().squaredNorm();
      for (int a = 0; a < D; ++a) dipole[a] += each.charge * x.back()[a];
    }
    temperatures_ += twice_kinetic / (D * std::max(1.0, static_cast<double>(all.size()) - 1));
    add(0, time, integrals_, x, v);
  }

  /// Adds values to a level, and every second time to the next level.
  void add(std::size_t level, double time, std::span<const double> integrals, const std::vector<Vec<D>>& x,
           std::vector<Vec<D>>& v) {
    if (level == levels_.size()) {
      Level& made = levels_.emplace_back();
      made.time.resize(kRing);
      made.integrals.resize(kRing * kIntegrals);
      made.x.resize(kRing * x.size());
      made.v.resize(kRing * x.size());
      made.series = Blocking((kLags + 1) * quantities());
    }
    Level& l = levels_[level];
    const std::size_t here = l.count % kRing;
    l.time[here] = time;
    std::ranges::copy(integrals, l.integrals.begin() + static_cast<std::ptrdiff_t>(here * kIntegrals));
    std::ranges::copy(x, l.x.begin() + static_cast<std::ptrdiff_t>(here * x.size()));
    std::ranges::copy(v, l.v.begin() + static_cast<std::ptrdiff_t>(here * x.size()));
    measure(l, level);
    if (++l.count % 2 == 1 || last_lag(level + 1) < first_lag(level + 1)) return;
    const Vec<D>* const before = &l.v[(here + kRing - 1) % kRing * x.size()];
    for (std::size_t i = 0; i < v.size(); ++i) v[i] = 0.5 * (v[i] + before[i]);
    add(level + 1, time, integrals, x, v);
  }

  /// Correlates the last values of a level with those before.
  void measure(Level& l, std::size_t level) {
    const std::size_t n = species_.size(), q = quantities(), here = l.count % kRing;
    const std::size_t last = std::min<std::size_t>(last_lag(level), l.count), first = first_lag(level);
    std::vector<double> squares((kLags + 1) * q), values(squares.size()), weights(squares.size());
    for (std::size_t lag = first / 2; lag <= last; ++lag) {
      const std::size_t there = (l.count - lag) % kRing;
      double* const at = &squares[lag * q];
      at[kTime] = l.time[here] - l.time[there];
      for (std::size_t k = 0; k < kIntegrals; ++k) {
        const double change = l.integrals[here * kIntegrals + k] - l.integrals[there * kIntegrals + k];
        at[k < kStresses       ? kShear
           : k < kStresses + D ? kHeat
                               : kCurrent] += change * change / (k < kStresses ? kStresses : D);
      }
      for (std::size_t i = 0; i < n; ++i) {
        const std::size_t kind = kSingle + (number_.size() > 1 ? 2 * (species_[i] + std::size_t{1}) : 0);
        at[kind] += l.v[here * n + i].dot(l.v[there * n + i]);
        at[kind + 1] += (l.x[here * n + i] - l.x[there * n + i]).squaredNorm();
      }
      for (std::size_t s = 0; number_.size() > 1 && s < number_.size(); ++s)
        for (const std::size_t k : {0, 1}) {
          double& of_kind = at[kSingle + 2 * (s + 1) + k];
          at[kSingle + k] += of_kind;
          of_kind /= number_[s];
        }
      for (const std::size_t k : {0, 1}) at[kSingle + k] /= static_cast<double>(n);
    }
    for (std::size_t lag = first; lag <= last; ++lag)
      for (std::size_t k = 0; k < q; ++k) {
        const bool mean = k == kTime || (k >= kSingle && (k - kSingle) % 2 == 0);
        const double *const to = &squares[lag * q], *const from = &squares[lag / 2 * q];
        values[lag * q + k] = mean ? to[k] : to[k] - from[k];
        weights[lag * q + k] = mean ? 1 : 2 * (k >= kSingle ? D : 1) * (to[kTime] - from[kTime]);
      }
    l.series.add(values, weights);
  }

  void sums(Archive& archive) override {
    archive(fluxes_, number_, species_, alike_, charged_, integrals_, temperatures_, levels_);
  }

  const System<D>& system_;
  double longest_;
  FluxIntegral<D> fluxes_;
  std::vector<double> number_;  // of particles, by species
  std::vector<std::uint16_t> species_;
  bool alike_ = true, charged_ = false;  // whether all have one mass and one |charge|; whether there are charges
  std::vector<double> integrals_;        // since the first sample
  double temperatures_ = 0;              // Σ over samples
  std::vector<Level> levels_;
};

template <int D>
std::optional<ParameterError> complete_transport(Parameters& parameters, const System<D>& system) {
  const auto refuse = [](const std::string& what, const std::string& remedy) {
    return ParameterError{"interval", "transport coefficients need " + what,
                          "set transport_interval = 0, or " + remedy};
  };
  for (int k = 0; k < D; ++k)
    if (!system.box.periodic(k))
      return refuse("a periodic box, and axis " + std::to_string(k) + " is not periodic", "make all axes periodic");
  if (!system.keeps_momentum() || system.box.bath.type != Bath::Type::none)
    return refuse("a motion that conserves energy and momentum, without walls, fields and baths", "remove them");
  if (!system.box.contacts.elastic() || system.box.contacts.rough())
    return refuse("elastic and smooth contacts", "remove the contact laws");
  if (!parameters.has("longest")) parameters.set("longest", kIntervals * parameters.real("interval"));
  if (parameters.real("longest") >= parameters.real("interval")) return {};
  return ParameterError{"longest", "the longest lag is shorter than the interval", "give a longer one"};
}

}  // namespace

ObservableInfo transport() {
  using enum Parameter::Type;
  return {
      .name = "transport",
      .title = "transport coefficients",
      .parameters =
          {parameter::interval(
               "the shortest lag of time correlations and transport coefficients, averaged into "
               "transport.csv; 0: none. With forces give one or few steps. A sample costs about 25 passes "
               "over the particles, on rank 0"),
           {"longest", real, "none", "time",
            "the longest lag, at which summary.json takes the coefficients: longer than correlations live, and "
            "shorter than sound needs for half the box; default: 100 intervals",
            Parameter::Range::positive}},
      .documentation =
          "Columns: time (the lag), vacf (the mean of v(0)v(t) over particles), diffusion, shear_viscosity, "
          "thermal_conductivity and electrical_conductivity (half the rate at which mean squared displacements and "
          "integrals of the fluxes of momentum, energy and charge grow between half the lag and the lag, divided by "
          "D, V T, V T^2 and V T), error_ and samples_ of each. With several species vacf and diffusion of each; "
          "thermal_conductivity for one species of equal masses and equal or opposite charges; "
          "electrical_conductivity if there are charges. T is that of N - 1 particles, and the drift of the whole "
          "system is taken off. Memory: 34 "
          "positions or velocities of each particle for each doubling of the lag from 16 intervals on, on rank 0.",
      .source =
          "Alder, Gass, Wainwright, J. Chem. Phys. 53 (1970) 3813; Ramirez, Sukumaran, Vorselaars, Likhtman, J. "
          "Chem. Phys. 133 (2010) 154103",
      .in_2d = maker<Transport, 2>(complete_transport<2>),
      .in_3d = maker<Transport, 3>(complete_transport<3>)};
}

}  // namespace carom::observable
