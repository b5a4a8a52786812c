// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The radial distribution function g(r), computed during a run.
//
//   RadialDistribution<3> rdf(system, {.sampling = {.interval = 5.0}, .range = 4.0, .bins = 200});
//   run.add(rdf);
//   run.run();
//   rdf.g(0, 1);                     // between species 0 and 1, one value for each shell
//
// g of a shell is the number of pairs counted there over the number for an ideal gas with as many particles: for n
// pairs, n V_shell/V in a periodic box (so that an ideal gas of N particles has g = 1, not 1 − 1/N). Along walls
// V_shell is the average volume of the shell in the region that the centres can reach (the edge less a radius at each
// wall; the smaller radius of two species): with u a random direction, the average of the product of 1 − r|u_k|/L_k
// over the walled axes. (Allen, Tildesley, Computer Simulation of Liquids, 2nd ed., section 2.6.)
//
// A sample reads linked cells in O(N); counts are integers, so that the order of summation does not matter.

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
  /// Keeps a reference to the system for its box. Throws Error(deck) if the box is open (it has no density) or the
  /// range exceeds longest_range().
  RadialDistribution(const System<D>& system, const RadialDistributionOptions& options);
  RadialDistribution(const System<D>& system, const Parameters& parameters, double start);

  /// Half the shortest periodic edge, or the shortest distance that centres can move between walls, if this is less.
  static double longest_range(const System<D>& system);
  /// Three of the largest diameters, or longest_range() if this is less.
  static double usual_range(const System<D>& system);

  /// The middles of the shells [length].
  std::vector<double> radii() const;
  /// g of all particles of any species.
  std::vector<double> g() const;
  /// g between two species; NaN if there are no such pairs.
  std::vector<double> g(std::size_t a, std::size_t b) const;
  /// The errors of g, one for each shell; the means of these estimates are numbers of pairs in a sample.
  std::vector<Estimate> errors() const;
  std::vector<Estimate> errors(std::size_t a, std::size_t b) const;
  /// g at contact between two species: ln g is fitted by a parabola in r to the shells between the contact distance and
  /// 1.15 times this distance, or to the first six shells, weighted by the counts. Absent if the species have several
  /// contact distances, or if fewer than four of these shells hold pairs.
  std::optional<double> contact_value(std::size_t a, std::size_t b) const;
  /// Its standard error; NaN if it is unknown.
  double contact_error(std::size_t a, std::size_t b) const;
  /// r, g, and g between each two species if there are several.
  std::vector<TableColumn> table() const override;
  /// All contact values.
  std::vector<SpeciesValue> species_values() const override;

 private:
  void add_sample(double time, const Particles<D>& particles) override;
  void sums(Archive& archive) override { archive(number_, smallest_, largest_, counts_, series_); }
  void count(const Particles<D>& particles);
  std::size_t pair_index(std::size_t a, std::size_t b) const;
  std::vector<double> expected(double samples, double pairs, double margin) const;
  std::vector<double> expected(double samples, std::size_t a, std::size_t b) const;
  std::vector<double> expected_of_all(double samples) const;
  std::vector<Estimate> errors_of(std::size_t pair, const std::vector<double>& expected) const;
  std::optional<double> contact_value_of(std::size_t a, std::size_t b, const std::vector<double>& counts,
                                         double samples) const;
  double pairs_between(std::size_t a, std::size_t b) const;

  const System<D>& system_;
  RadialDistributionOptions options_;
  std::vector<double> number_, smallest_, largest_;  // by species: number of particles; radii
  std::vector<std::uint64_t> counts_;                // [pair of species][shell]
  Blocking series_;                                  // of the counts of a sample, with those of all species at the end

  std::array<std::vector<double>, D> x_;  // positions in the order of the cells; kept for reuse of memory
  std::vector<std::uint16_t> species_;
  std::vector<std::uint32_t> cell_, start_;
};

}  // namespace carom
