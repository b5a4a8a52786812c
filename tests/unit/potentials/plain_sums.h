// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// All bits of a term's sums, and the corresponding sums by simple loops over pairs.

#include <gtest/gtest.h>

#include "engine/forces/forces.h"
#include "tests/unit/potentials/scene.h"

namespace carom::test {

template <int D>
using Quanta = std::vector<std::array<typename ForceSums<D>::Whole, D>>;

template <int D>
Quanta<D> quanta(const ForceSums<D>& sums) {
  Quanta<D> all;
  for (Id i = 0; i < sums.size(); ++i) all.push_back(sums.quanta(i));
  return all;
}

/// All results of a term.
template <int D>
struct Outcome {
  Quanta<D> forces, mean_forces, products;
  std::vector<double> sums;
  std::uint64_t pairs = 0;
  bool operator==(const Outcome&) const = default;
};

template <int D>
Outcome<D> outcome(const Interaction<D>& term, const std::vector<Vec<D>>& x, const std::vector<Vec<D>>& x_new) {
  Outcome<D> result;
  ForceSums<D> forces(x.size(), kQuantum), mean(x.size(), kQuantum), products(x.size(), kQuantum);
  PotentialSums sums{.quantum = kQuantum};
  term.add_forces(x, forces, &sums);
  result.pairs = term.add_mean_forces(x, x_new, mean);
  term.add_hessian_product(x, x_new, products);
  result.forces = quanta(forces);
  result.mean_forces = quanta(mean);
  result.products = quanta(products);
  const PotentialSums alone = test::sums(term, x);
  for (const PotentialSums* each : {static_cast<const PotentialSums*>(&sums), &alone})
    result.sums.insert(result.sums.end(), {each->energy.value(), each->magnitude.value(), each->virial.value()});
  ForceSums<D> without_sums(x.size(), kQuantum);
  term.add_forces(x, without_sums);
  EXPECT_TRUE(quanta(without_sums) == result.forces);
  return result;
}

/// Sums of a potential by simple double loops over pairs and images.
template <int D>
struct Reference {
  using Whole = typename ForceSums<D>::Whole;
  Quanta<D> forces, mean_forces;
  Whole energy = 0;
  Whole by_tilt = 0, mean_by_tilt = 0;  // −Σ n F_x, n the number of the image along the second axis
  double own = 0, own_size = 0;         // Σ U and Σ |U| between particles and their own images

  template <class P>
  Reference(const Scene<D>& scene, const P& potential, double cutoff2, const std::vector<double>* weight,
            const std::vector<Vec<D>>& x, const std::vector<Vec<D>>& x_new, double quantum = kQuantum) {
    forces.resize(x.size());
    mean_forces.resize(x.size());
    const auto rounded = [&](double value) { return static_cast<Whole>(std::nearbyint(value / quantum)); };
    const int images = scene.box.periodic(0) ? 2 : 0;
    for (Id i = 0; i < x.size(); ++i)
      for (Id j = i; j < x.size(); ++j)
        for (int n = 0; n < static_cast<int>(std::pow(2 * images + 1, D)); ++n) {
          Image<D> image;
          for (int k = 0, rest = n; k < D; ++k, rest /= 2 * images + 1) image[k] = rest % (2 * images + 1) - images;
          const Vec<D> shift = scene.box.shift(image), d = x[i] - x[j] + shift,
                       d_new = x_new[i] - x_new[j] + scene.box.next_shift(image);
          const double rho = d.squaredNorm(), rho_new = d_new.squaredNorm();
          const double w = weight ? (*weight)[i] * (*weight)[j] : 1;
          if (w == 0) continue;
          if (i == j) {
            if (image == Image<D>{} || !(rho < cutoff2)) continue;
            own += 0.5 * w * potential.value(rho);
            own_size += 0.5 * std::abs(w * potential.value(rho));
            continue;
          }
          if (rho < cutoff2) {
            energy += rounded(w * potential.value(rho));
            for (int k = 0; k < D; ++k) add(forces, i, j, k, rounded(-2.0 * w * potential.derivative(rho) * d[k]));
            by_tilt -= image[1] * rounded(-2.0 * w * potential.derivative(rho) * d[0]);
          }
          if (!(rho < cutoff2 || rho_new < cutoff2)) continue;
          const auto mean = [&](int k) { return rounded(-w * potential.quotient(rho, rho_new) * (d[k] + d_new[k])); };
          for (int k = 0; k < D; ++k) add(mean_forces, i, j, k, mean(k));
          mean_by_tilt -= image[1] * mean(0);
        }
  }
  static void add(Quanta<D>& sums, Id i, Id j, int k, Whole force) {
    sums[i][k] += force;
    sums[j][k] -= force;
  }
};

template <int D, class P>
void expect_reference(const Scene<D>& scene, const Interaction<D>& term, const P& potential, double cutoff2,
                      const std::vector<double>* weight, const std::vector<Vec<D>>& x,
                      const std::vector<Vec<D>>& x_new) {
  const Reference<D> expected(scene, potential, cutoff2, weight, x, x_new);
  const Outcome<D> result = outcome(term, x, x_new);
  EXPECT_TRUE(result.forces == expected.forces);
  EXPECT_TRUE(result.mean_forces == expected.mean_forces);
  const double energy = static_cast<double>(expected.energy) * kQuantum + expected.own;
  EXPECT_NEAR(result.sums[0], energy, expected.own_size > 0 ? 1e-15 * (expected.own_size + std::abs(energy)) : 0);
}

using Options = std::vector<std::pair<std::string, ParameterValue>>;

inline Options cut_lennard_jones(double sigma, double cutoff) {
  return {{"epsilon", 1.0}, {"sigma", sigma}, {"cutoff", cutoff}, {"cut", std::string("shifted")}};
}

}  // namespace carom::test
