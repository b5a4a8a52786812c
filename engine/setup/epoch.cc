// SPDX-License-Identifier: BSD-3-Clause
#include "engine/setup/epoch.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <numbers>

#include "engine/base/record.h"
#include "engine/ranks/id_blocks.h"
#include "engine/search/search_tuning.h"
#include "engine/setup/placement.h"

namespace carom {
namespace {
/// The longest epoch, relative to the relaxation time of a bath that rescales at the ends of epochs: the kinetic energy
/// moves by at most a tenth of its distance from the mean at once.
constexpr double kEpochOfRelaxation = 0.1;
/// The events of a sphere in an epoch: starting an epoch costs a fifth of an event for each sphere.
constexpr double kEventsOfEpoch = 40;
/// How far a sphere may fly in an epoch. The time of an event and the position of its spheres are rounded to 2^-53 of
/// the time and the path since the start of the epoch. With the first limit [smallest diameter], for epochs that are
/// longer than the default, these are together less than 1e-12 of the smallest contact distance. With the second one
/// [longest edge] they are a few times the rounding of any position in the box, however small the spheres.
constexpr double kFarthest = 4096;
constexpr double kFarthestInBoxes = 4;
/// In an epoch a sphere may become this many times faster than all were before: it gets up to twice the speed of a
/// heavy sphere.
constexpr double kFaster = 4;
/// Slabs of a run in a sheared box: 10⁹ take a day even for a few spheres.
constexpr double kMostSlabs = 1e9;
/// The longest epoch, relative to the last one.
constexpr double kLonger = 64;

/// The speeds of a gas: sums over all particles, and what they would be in equilibrium.
template <int D>
struct Gas {
  double thermal_speed = 0;    ///< √(Σ m v²/(D Σ m)); 0 if nothing moves
  double light_speed = 0;      ///< the thermal speed of the lightest particles, in equilibrium
  double fastest = 0;          ///< |v|
  double contacts_a_time = 0;  ///< of a sphere
};

template <int D>
Gas<D> gas_of(const System<D>& system) {
  const auto& p = system.particles;
  const auto n = static_cast<double>(system.size());
  struct Sums {
    double twice_kinetic = 0, mass = 0, diameter = 0, fastest = 0, lightest = std::numeric_limits<double>::infinity();
  };
  Communicator alone;
  const auto [at_start, mass, diameter, fastest, lightest] = accumulated_in_order(
      system.decomposition.others() ? *system.decomposition.others() : alone, Sums{}, [&](Sums& sums) {
        for (std::size_t i = 0; i < p.size(); ++i) {
          sums.twice_kinetic += moving_mass(p.mass[i]) * p.v[i].squaredNorm();
          sums.mass += moving_mass(p.mass[i]) / n;
          sums.diameter += 2 * p.radius[i] / n;
          sums.fastest = std::max(sums.fastest, p.v[i].norm());
          sums.lightest = std::min(sums.lightest, p.mass[i]);
        }
      });
  const double filled = packing_fraction<D>(system.box.volume(), p.radius, system.decomposition.others());
  const Bath& bath = system.box.bath;
  const bool heated = bath.type != Bath::Type::none;
  const double hottest = heated ? std::max(bath.temperature, bath.last_temperature) : 0;
  const double twice_kinetic = std::max(at_start, D * n * hottest);
  if (twice_kinetic == 0 || mass == 0) return {};
  const double thermal_speed = std::sqrt(twice_kinetic / (D * n * mass));
  return {
      .thermal_speed = thermal_speed,
      // In equilibrium, where the lightest are the fastest.
      .light_speed = std::sqrt(twice_kinetic / (D * n * lightest)),
      .fastest = fastest,
      .contacts_a_time = thermal_speed * contacts_a_length({D, n / system.box.volume(), filled, diameter, diameter})};
}
}  // namespace

template <int D>
double contact_rate(const System<D>& system) {
  return gas_of(system).contacts_a_time;
}

namespace {
template <int D>
double strain_of_slab(const System<D>& system) {
  // The images of a row of boxes slide by half of the strain before and after the middle of the slab.
  const Box<D>& box = system.box;
  const double boxes = Packing<D>(1, system.size()).largest() - 2;
  return std::min(kStrainOfSlab, 2 * boxes * box.edges[0] / box.edges[1]);
}
}  // namespace

template <int D>
double longest_slab(const System<D>& system, double start) {
  return strain_of_slab(system) / std::abs(system.box.shear_rate_at(start));
}

template <int D>
std::string shear_problem(const System<D>& system, std::optional<double> end_time, double step, double start) {
  const Box<D>& box = system.box;
  if (!box.sheared()) return "";
  if (Packing<D>(1, system.size()).largest() < 3)
    return "'shear' is for fewer particles, because the numbers of images have few bits beside so many; take fewer";
  const double fastest = box.fastest_shear(), slide = fastest * box.edges[1];
  if (!std::isfinite(slide * slide) || (end_time && *end_time > kMostSlabs * strain_of_slab(system) / fastest))
    return "the rate of 'shear', " + short_text(fastest) + ", is so large that the run would have more than " +
           short_text(kMostSlabs) + " epochs, one for a strain of " + short_text(kStrainOfSlab) +
           "; give a smaller rate, or end the run earlier";
  for (const auto& each : box.shear_rates) {
    const double after = each[0] - start, steps = std::round(after / step);
    if (step > 0 && after > 0 && std::abs(after - steps * step) > 1e-9 * step + 1e-12 * each[0])
      return "the rate of 'shear' changes at the time " + short_text(each[0], 15) +
             ", within a step of this method; give a time at which a step of " + short_text(step, 15) +
             " starts, such as " + short_text(start + steps * step, 15);
  }
  return "";
}

template <int D>
double default_epoch(const System<D>& system) {
  const auto [thermal_speed, light_speed, fastest, rate] = gas_of(system);
  if (thermal_speed == 0) return 1;
  const Bath& bath = system.box.bath;
  const double farthest = kFarthestInBoxes * system.box.edges.maxCoeff();
  double epoch = std::min(kEventsOfEpoch / rate, farthest / std::max(thermal_speed, light_speed));
  // The flow makes neighbours meet about once in a strain, also if they are cold.
  epoch = std::min(epoch, kEventsOfEpoch / system.box.fastest_shear());
  if (bath.acts_at_ends()) epoch = std::min(epoch, kEpochOfRelaxation / bath.relaxation_rate());
  // The image of a sphere, as another one sees it, perhaps through a face, must fit into a candidate on any number of
  // ranks. In equilibrium a component of a relative velocity has the standard deviation √2 of the thermal speed, and
  // one of 10¹⁵ is larger than eight of them; a dilute gas of 10⁴ spheres has 10⁶ candidates in an epoch.
  const double speed = std::max(2 * fastest, 8 * std::numbers::sqrt2 * light_speed);
  const Packing<D> packing(1, system.size());  // largest() depends on the number of particles only
  for (int k = 0; k < D; ++k)
    if (system.box.periodic(k))
      epoch = std::min(epoch, std::max(packing.largest() - 1, 1) * system.box.edges[k] / speed);
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), epoch, std::chars_format::scientific, 1).ptr;
  double rounded = epoch;
  std::from_chars(text.data(), end, rounded);
  return rounded;
}

template <int D>
void choose_epoch(const System<D>& system, Parameters& given, double step) {
  if (given.has("step")) return;
  given.set("step", step > 0 ? step : default_epoch(system));
  if (!given.has("lengthen")) given.set("lengthen", true);
}

template <int D>
double next_epoch(const System<D>& system, const PastEpoch& past) {
  const auto& p = system.particles;
  std::array<double, 4> largest{-std::numeric_limits<double>::infinity(), 0, past.boxes, -1};
  auto& [minus_diameter, fastest, boxes, minus_lightest] = largest;
  minus_lightest = minus_diameter;
  for (std::size_t i = 0; i < p.size(); ++i) {
    minus_diameter = std::max(minus_diameter, -2 * p.radius[i]);
    minus_lightest = std::max(minus_lightest, -p.mass[i]);
    fastest = std::max(fastest, p.v[i].norm());
  }
  system.decomposition.ranks().largest(largest);
  double hottest = 0;
  const Bath& bath = system.box.bath;
  if (bath.type != Bath::Type::none) hottest = std::max(bath.temperature, bath.last_temperature);
  for (const auto& wall : system.box.options) {
    hottest = std::max(hottest, wall.temperature);
    if (wall.moves()) return 0;
  }
  if (!system.interactions.empty()) return 0;
  fastest = std::max(fastest, 5 * std::sqrt(hottest / -minus_lightest));
  const double farthest = std::max(kFarthest * -minus_diameter, kFarthestInBoxes * system.box.edges.maxCoeff());
  double longest = std::min(kLonger * past.length, farthest / fastest);
  longest = std::min(longest, kEventsOfEpoch / past.events * past.length);
  const double count = Packing<D>(1, system.size()).largest(), came = boxes + 1;
  for (int k = 0; k < D; ++k) {
    if (!system.box.periodic(k)) continue;
    const double edge = system.box.edges[k];
    // Spheres that turn often come as far as the root of the time.
    const bool wanders = fastest * past.length > kFaster * came * edge;
    const double as_measured = wanders ? (count / came) * (count / came) / 4 : count / came / kFaster;
    longest = std::min(longest, std::max(count / kFaster * edge / fastest, past.length * as_measured));
  }
  return longest;
}

template double longest_slab(const System<2>&, double);
template double longest_slab(const System<3>&, double);
template std::string shear_problem(const System<2>&, std::optional<double>, double, double);
template std::string shear_problem(const System<3>&, std::optional<double>, double, double);
template double contact_rate(const System<2>&);
template double contact_rate(const System<3>&);
template double default_epoch(const System<2>&);
template double default_epoch(const System<3>&);
template void choose_epoch(const System<2>&, Parameters&, double);
template void choose_epoch(const System<3>&, Parameters&, double);
template double next_epoch(const System<2>&, const PastEpoch&);
template double next_epoch(const System<3>&, const PastEpoch&);

}  // namespace carom
