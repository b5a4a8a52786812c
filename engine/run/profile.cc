// SPDX-License-Identifier: BSD-3-Clause
// Densities, temperatures, velocities and pressures in slabs across one axis.
//
// The slabs divide the space between the faces of the box as it is at each sample, so that they follow walls that move.
// Every column is Σv/Σw over samples (blocking.h): the particles n (by their centres) of a slab over its volume V;
// Σ m v² over D n and Σ m v over Σ m, without fixed particles. The mean velocity is not subtracted.
//
// The pressure in a slab is Σ (m v_a v_b + ½ Σ d_a F_b) + ½ Σ d_a J_b/t over V: one half of what passes between two
// particles counts in the slab of each, as in LAMMPS' stress/atom (Thompson, Plimpton, Mattson, J. Chem. Phys. 131
// (2009) 154107). Its sum over all slabs is the pressure tensor's.

#include <algorithm>

#include "engine/run/fluxes.h"

namespace carom::observable {
namespace {

template <int D>
class Profile : public Observable<D> {
 public:
  Profile(const System<D>& system, const Parameters& parameters, double start)
      : Observable<D>({parameters.real("interval"), start}),
        system_(system),
        axis_(static_cast<int>(parameters.integer("axis"))),
        bins_(static_cast<std::size_t>(parameters.integer("bins"))),
        pressure_(parameters.flag("pressure")),
        collisions_(pressure_ ? bins_ : 0, Tensor<D>::Zero()) {
    const auto add = [&](const std::string& name) { names_.push_back(name); };
    add("density"), add("temperature");
    for (int a = 0; a < D; ++a) add(std::string("velocity_") + kAxes[a]);
    if (parts() > 0)
      for (const char* const quantity : {"density_", "temperature_"})
        for (const std::string& each : system.species) add(quantity + each);
    if (pressure_)
      for (int a = 0; a < D; ++a)
        for (int b = a; b < D; ++b) add(std::string("pressure_") + kAxes[a] + kAxes[b]);
    series_ = Blocking(names_.size() * bins_);
  }

  bool divided() const override { return true; }
  bool needs_contacts() const override { return pressure_; }
  void contacts(double slab_start, std::span<const Contact<D>> contacts) override {
    if (!pressure_ || this->samples() == 0) return;
    for (const Contact<D>& each : contacts) {
      if (each.key.kind != EventKind::pair) continue;
      const Tensor<D> half = 0.5 * (each.x_lo - each.x_hi) * each.impulse.transpose();
      for (const Vec<D>& x : {each.x_lo, each.x_hi})
        if (const std::size_t s = slab_of(x, faces(slab_start + each.key.time)); s < bins_) collisions_[s] += half;
    }
  }

  std::vector<TableColumn> table() const override {
    std::vector<TableColumn> table = {{"x", {}}};
    const auto samples = static_cast<double>(this->samples());
    for (std::size_t s = 0; s < bins_; ++s)
      table[0].values.push_back(
          (faces_.lower + (static_cast<double>(s) + 0.5) / static_cast<double>(bins_) * faces_.length) / samples);
    for (std::size_t c = 0; c < names_.size(); ++c) {
      std::vector<double> means;
      std::vector<Estimate> estimates;
      for (std::size_t s = 0; s < bins_; ++s) {
        estimates.push_back(series_.estimate(c * bins_ + s));
        means.push_back(estimates.back().mean);
      }
      add_estimates(table, names_[c], means, estimates);
    }
    return table;
  }

 private:
  static constexpr std::array kAxes = {'x', 'y', 'z'};
  /// Where the lower face is, and the distance of the upper one from it [length].
  struct Faces {
    double lower = 0, length = 0;
  };

  /// The number of species, each of which has a density and a temperature of its own; 0 if there is only one.
  std::size_t parts() const { return system_.species.size() > 1 ? system_.species.size() : 0; }
  Faces faces(double time) const { return {system_.box.lower(axis_, time), system_.box.lengths(time)[axis_]}; }
  /// The slab of a position; bins_ where the axis is open and the position beyond the box.
  std::size_t slab_of(const Vec<D>& x, const Faces& between) const {
    double at = (x[axis_] - between.lower) / between.length;
    if (system_.box.periodic(axis_)) at -= std::floor(at);
    if (system_.box.boundary[axis_] == Boundary::open && !(at >= 0 && at < 1)) return bins_;
    const auto all = static_cast<double>(bins_);
    return static_cast<std::size_t>(std::clamp(at * all, 0.0, all - 1));
  }

  void add_sample(double time, const Particles<D>& particles) override {
    const std::vector<Traveller<D>> all = travellers(system_, particles);
    std::vector<Tensor<D>> flux = forces(time, particles);
    if (all.empty()) return;  // not rank 0
    std::vector<double> values(series_.columns()), weights(series_.columns());
    const auto add = [&](std::size_t column, std::size_t slab, double value, double weight) {
      values[column * bins_ + slab] += value;
      weights[column * bins_ + slab] += weight;
    };
    const Faces now = faces(time);
    for (const Traveller<D>& each : all) {
      const std::size_t s = slab_of(each.x, now);
      if (s == bins_) continue;
      add(0, s, 1, 0);
      if (parts() > 0) add(2 + D + each.species, s, 1, 0);
      if (!(each.mass > 0)) continue;  // fixed
      const double twice_kinetic = each.mass * each.v.squaredNorm();
      add(1, s, twice_kinetic, D);
      for (int a = 0; a < D; ++a) add(2 + static_cast<std::size_t>(a), s, each.mass * each.v[a], each.mass);
      if (parts() > 0) add(2 + D + parts() + each.species, s, twice_kinetic, D);
      if (pressure_) flux[s] += each.mass * each.v * each.v.transpose();
    }
    const double volume = system_.box.lengths(time).prod() / static_cast<double>(bins_), elapsed = time - before_;
    for (std::size_t s = 0; s < bins_; ++s) {
      add(0, s, 0, volume);
      for (std::size_t k = 0; k < parts(); ++k) add(2 + D + k, s, 0, volume);
      if (!pressure_ || this->samples() == 0) continue;
      const Tensor<D> sum = elapsed * flux[s] + std::exchange(collisions_[s], Tensor<D>::Zero());
      std::size_t column = 2 + D + 2 * parts();
      for (int a = 0; a < D; ++a)
        for (int b = a; b < D; ++b) add(column++, s, 0.5 * (sum(a, b) + sum(b, a)), elapsed * volume);
    }
    series_.add(values, weights);
    faces_.lower += now.lower;
    faces_.length += now.length;
    before_ = time;
  }
  /// Σ ½ d F of the particles in each slab, on rank 0. Collective.
  std::vector<Tensor<D>> forces(double time, const Particles<D>& particles) const {
    std::vector<Tensor<D>> sums(pressure_ ? bins_ : 0, Tensor<D>::Zero());
    if (!pressure_ || system_.interactions.empty()) return sums;
    std::vector<std::uint32_t> slabs;
    for (const Vec<D>& x : particles.x) slabs.push_back(static_cast<std::uint32_t>(slab_of(x, faces(time))));
    const std::vector<Vec<D>> v(particles.size(), Vec<D>::Zero());
    PairFluxes<D> own;
    own.slab_of = slabs;
    own.in_slab.resize(bins_);
    for (const auto& term : system_.interactions) term->add_fluxes(particles.x, v, own);
    if (Communicator* const others = system_.decomposition.others()) own = sum_of_all(*others, own);
    for (std::size_t s = 0; s < bins_; ++s)
      for (int a = 0; a < D; ++a)
        for (int b = 0; b < D; ++b) sums[s](a, b) = own.in_slab[s][D * a + b].value();
    return sums;
  }

  void sums(Archive& archive) override { archive(faces_, before_, collisions_, series_); }

  const System<D>& system_;
  int axis_;
  std::size_t bins_;
  bool pressure_;
  std::vector<std::string> names_;     // of the columns
  Faces faces_;                        // summed over samples
  double before_ = 0;                  // the last sample
  std::vector<Tensor<D>> collisions_;  // Σ ½ d J in each slab since then
  Blocking series_;                    // [column][slab]
};

template <int D>
std::optional<ParameterError> complete_profile(Parameters& parameters, const System<D>&) {
  if (parameters.integer("axis") < D) return {};
  return ParameterError{"axis", "there is no such axis", "the axes are numbered from 0"};
}

}  // namespace

ObservableInfo profile() {
  using enum Parameter::Type;
  return {
      .name = "profile",
      .title = "densities, temperatures, velocities and pressures across the box",
      .parameters = {parameter::interval("simulated time between samples of the profile of density, temperature and "
                                         "velocity, averaged into profile.csv; 0: none"),
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
                      .range = Parameter::Range::non_negative},
                     {.name = "pressure",
                      .type = boolean,
                      .fallback = "false",
                      .unit = "-",
                      .meaning =
                          "whether the profile has the pressure in each slab; collisions between samples are all "
                          "counted, with forces give a few steps as interval"}},
      .documentation =
          "The slabs divide the space between the faces of the box, as it is at each sample where walls move. Along an "
          "open axis they divide the edge that system.box gives, and particles beyond it are in no slab. Further walls "
          "do not change the volume of a slab. Columns: x (the mean middle of a slab), density (of centres), "
          "temperature 2K/(D n) of the n particles in the slab, their mean velocity is not subtracted; velocity_x, …: "
          "momentum over mass; with several species density_A and temperature_A of each; with pressure = true "
          "pressure_xx, pressure_xy, …: (sum m v v + sum d F/2 + sum d J/(2 t))/V over the particles of the slab and "
          "their partners, as in pressure_tensor.csv, of whose symmetric part it is the mean over slabs, without "
          "long-range corrections (the stress is its negative); error_ and samples_ of all.",
      .source = "Allen, Tildesley, Computer Simulation of Liquids, 2nd ed., section 2.12",
      .in_2d = maker<Profile, 2>(complete_profile<2>),
      .in_3d = maker<Profile, 3>(complete_profile<3>),
      .sheared = true};
}

}  // namespace carom::observable
