// SPDX-License-Identifier: BSD-3-Clause
#include "engine/setup/epoch.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <limits>

#include "engine/base/record.h"
#include "engine/ranks/id_blocks.h"
#include "engine/search/search_tuning.h"
#include "engine/setup/placement.h"

namespace carom {
namespace {
/// The longest epoch, relative to the relaxation time of a bath that rescales at the ends of epochs: the kinetic energy
/// moves by at most a tenth of its distance from the mean at once.
constexpr double kEpochOfRelaxation = 0.1;
}  // namespace

template <int D>
double default_epoch(const System<D>& system) {
  const auto& p = system.particles;
  const auto n = static_cast<double>(system.size());
  struct Sums {
    double twice_kinetic = 0, mass = 0, diameter = 0, fastest = 0, lightest = std::numeric_limits<double>::infinity();
  };
  Communicator alone;
  const auto [at_start, mass, diameter, fastest, lightest] = accumulated_in_order(
      system.decomposition.others() ? *system.decomposition.others() : alone, Sums{}, [&](Sums& sums) {
        for (std::size_t i = 0; i < p.size(); ++i) {
          sums.twice_kinetic += p.mass[i] * p.v[i].squaredNorm();
          sums.mass += p.mass[i] / n;
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
  if (twice_kinetic == 0) return 1;
  const double thermal_speed = std::sqrt(twice_kinetic / (D * n * mass));
  const double rate = thermal_speed * contacts_a_length({D, n / system.box.volume(), filled, diameter, diameter});
  const double farthest = std::min(300 * diameter, 4 * system.box.edges.minCoeff());
  double epoch = std::min(40 / rate, farthest / thermal_speed);
  if (bath.rescales()) epoch = std::min(epoch, kEpochOfRelaxation / bath.rate);
  // The images of the fastest particles, also in equilibrium, must fit into a candidate on any number of ranks.
  const double speed = std::max(fastest, 5 * std::sqrt(twice_kinetic / (D * n * lightest)));
  const Packing<D> packing(1, system.size());
  for (int k = 0; k < D; ++k)
    if (system.box.periodic(k)) epoch = std::min(epoch, packing.largest() * system.box.edges[k] / speed);
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), epoch, std::chars_format::scientific, 1).ptr;
  double rounded = epoch;
  std::from_chars(text.data(), end, rounded);
  return rounded;
}

template double default_epoch(const System<2>&);
template double default_epoch(const System<3>&);

}  // namespace carom
