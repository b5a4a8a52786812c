// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A small system to test interactions: random particles in a box, and interactions made by name.

#include <random>
#include <string>
#include <utility>
#include <vector>

#include "engine/forces/pair_filter.h"
#include "engine/laws/interaction.h"

namespace carom::test {

template <int D>
struct Scene {
  Box<D> box;
  Particles<D> particles;
  std::vector<std::string> species = {"A", "B"};

  /// `count` points, uniform in a box of this edge; all distances, images included, are at least `apart`.
  Scene(int count, double edge, Boundary boundary, double apart) {
    box.edges = Vec<D>::Constant(edge);
    box.boundary.fill(boundary);
    std::uniform_real_distribution<double> uniform(0, 1);
    while (static_cast<int>(particles.size()) < count) {
      Vec<D> x;
      for (int k = 0; k < D; ++k) x[k] = edge * uniform(random);
      bool free = true;
      for (const Vec<D>& other : particles.x) free = free && nearest(x - other).norm() >= apart;
      if (!free) continue;
      const auto n = particles.size();
      particles.x.push_back(x);
      particles.v.push_back(Vec<D>::Zero());
      particles.mass.push_back(1 + uniform(random));
      particles.radius.push_back(0.1);
      particles.charge.push_back(n % 2 == 0 ? 1.0 : -0.5);
      particles.species.push_back(static_cast<std::uint16_t>(n % 3 == 0 ? 1 : 0));
      particles.image.push_back({});
    }
  }

  Vec<D> nearest(const Vec<D>& d) const { return d + box.shift(box.nearest_image(d)); }

  std::vector<Vec<D>> random_vectors(double size) {
    std::uniform_real_distribution<double> uniform(-size, size);
    std::vector<Vec<D>> w(particles.size());
    for (Vec<D>& each : w)
      for (int k = 0; k < D; ++k) each[k] = uniform(random);
    return w;
  }

  std::unique_ptr<Interaction<D>> make(const std::string& type,
                                       const std::vector<std::pair<std::string, ParameterValue>>& given,
                                       std::shared_ptr<const BondTable> bonds = nullptr) const {
    Parameters parameters;
    for (const auto& [name, value] : given) parameters.set(name, value);
    for (const InteractionInfo& info : interactions())
      if (info.name == type)
        return info.make<D>(parameters, {.box = box, .particles = particles, .species = species, .bonds = bonds});
    throw std::invalid_argument("no interaction '" + type + "'");
  }

  std::mt19937_64 random{11};
};

inline constexpr double kQuantum = 0x1p-50;  ///< of forces and energies

template <int D>
PotentialSums sums(const Interaction<D>& term, const std::vector<Vec<D>>& x) {
  PotentialSums result{.quantum = kQuantum};
  term.add_energy(x, result);
  return result;
}

template <int D>
double energy(const Interaction<D>& term, const std::vector<Vec<D>>& x) {
  return sums(term, x).energy.value();
}

template <int D>
std::vector<Vec<D>> values(const ForceSums<D>& sums) {
  std::vector<Vec<D>> f;
  for (Id i = 0; i < sums.size(); ++i) f.push_back(sums.value(i));
  return f;
}

template <int D>
std::vector<Vec<D>> forces(const Interaction<D>& term, const std::vector<Vec<D>>& x) {
  ForceSums<D> sums(x.size(), kQuantum);
  term.add_forces(x, sums);
  return values(sums);
}

template <int D>
std::vector<Vec<D>> mean_forces(const Interaction<D>& term, const std::vector<Vec<D>>& x,
                                const std::vector<Vec<D>>& x_new) {
  ForceSums<D> sums(x.size(), kQuantum);
  term.add_mean_forces(x, x_new, sums);
  return values(sums);
}

template <int D>
std::vector<Vec<D>> displaced(std::vector<Vec<D>> x, const std::vector<Vec<D>>& w, double by) {
  for (std::size_t i = 0; i < x.size(); ++i) x[i] += by * w[i];
  return x;
}

}  // namespace carom::test
