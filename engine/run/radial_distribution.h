// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The radial distribution function g(r), taken while a run goes on.
//
//   RadialDistribution<3> rdf(system, {.sampling = {.interval = 5.0}, .range = 4.0, .bins = 200});
//   run.add(rdf);
//   run.run();
//   rdf.g(0, 1);                     // between species 0 and 1, one value for each shell
//
// g of a shell is the number of pairs counted there over the number that an ideal gas of as many particles has: with n
// pairs, n V_shell/V in a periodic box (so that an ideal gas of N particles has g = 1, not 1 − 1/N). Along walls
// V_shell is what the shell has, on average, in the region that the centres can reach (the edge less a radius at each
// wall; the smaller one of two species): with u a direction at random, the average of the product of 1 − r|u_k|/L_k
// over the walled axes. (Allen, Tildesley, Computer Simulation of Liquids, 2nd ed., section 2.6.)
//
// A sample goes through linked cells in O(N); what is kept are whole numbers, so that no order of summation matters.

#include <cstdint>
#include <optional>
#include <vector>

#include "engine/run/observable.h"

namespace carom {

struct RadialDistributionOptions {
  Sampling sampling;
  double range = 0;  ///< the largest r [length], > 0; at most longest_range()
  int bins = 200;    ///< shells of equal thickness from 0 to `range`
};

template <int D>
class RadialDistribution : public Observable<D> {
 public:
  /// Keeps a reference to the system, for its box. Throws Error(deck) for a box that is open (it has no density) and a
  /// range beyond longest_range().
  RadialDistribution(const System<D>& system, const RadialDistributionOptions& options);
  RadialDistribution(const System<D>& system, const Parameters& parameters, double start);

  /// Half the shortest periodic edge, or the shortest way between walls that centres can go, if that is less.
  static double longest_range(const System<D>& system);
  /// Three of the largest diameters, or longest_range() where that is less.
  static double usual_range(const System<D>& system);

  /// The middles of the shells [length].
  std::vector<double> radii() const;
  /// g of all particles, whatever their species.
  std::vector<double> g() const;
  /// g between two species; NaN where there are no such pairs.
  std::vector<double> g(std::size_t a, std::size_t b) const;
  /// g at contact between two species: ln g is fitted by a parabola in r to the shells that lie between the contact
  /// distance and 1.15 times that, or the first six, with the counts as weights. Nothing where the species have several
  /// contact distances, or fewer than four shells hold pairs there.
  std::optional<double> contact_value(std::size_t a, std::size_t b) const;
  /// r, g, and where there are several species g between each two.
  std::vector<TableColumn> table() const override;
  /// All contact values.
  std::vector<SpeciesValue> species_values() const override;

 private:
  void add_sample(double time, const Particles<D>& particles) override;
  void sums(Archive& archive) override { archive(number_, smallest_, largest_, counts_); }
  void count(const Particles<D>& particles);
  std::size_t pair_index(std::size_t a, std::size_t b) const;
  std::vector<double> normalised(const std::vector<std::uint64_t>& counts, double pairs, double margin) const;
  double pairs_between(std::size_t a, std::size_t b) const;

  const System<D>& system_;
  RadialDistributionOptions options_;
  std::vector<double> number_, smallest_, largest_;  // of each species: particles; radii
  std::vector<std::uint64_t> counts_;                // [pair of species][shell]

  std::array<std::vector<double>, D> x_;  // positions in the order of the cells; kept for their memory
  std::vector<std::uint16_t> species_;
  std::vector<std::uint32_t> cell_, start_;
};

}  // namespace carom
