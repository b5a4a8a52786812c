#pragma once
// rdf.csv and msd.csv: what is averaged while a run goes on instead of being written frame by frame.
//
// rdf.csv: r (middle of a shell), g (of all particles), and where there are several species g_A_B for each pair of
// their names, in the order of the deck. msd.csv: time (the lag), origins (averaged over, besides the particles), msd,
// and where there are several species msd_A for each. Reduced units; numbers in the fewest digits that give them back
// exactly. What is measured is defined in engine/radial_distribution.h and engine/mean_squared_displacement.h.
//
// The files are put in place anew as a whole, whenever the number of samples has doubled, and at the end: after a kill
// at least half of the samples are there.

#include <filesystem>
#include <string>
#include <vector>

#include "engine/mean_squared_displacement.h"
#include "engine/radial_distribution.h"

namespace carom {

/// g at contact between two species, extrapolated.
struct ContactValue {
  std::string first, second;
  double g;
};

template <int D>
class RdfWriter : public RadialDistribution<D> {
 public:
  RdfWriter(std::filesystem::path path, const System<D>& system, const RadialDistributionOptions& options);

  /// Throws Error(Failure::file).
  void sample(double time, const Particles<D>& particles) override;
  /// The average up to now. Throws Error(Failure::file).
  void close() const;
  /// Of all pairs of species that have one.
  std::vector<ContactValue> contact_values() const;

 private:
  std::filesystem::path path_;
  std::vector<std::string> species_;
};

template <int D>
class MsdWriter : public MeanSquaredDisplacement<D> {
 public:
  MsdWriter(std::filesystem::path path, const System<D>& system, const Sampling& sampling);

  /// Throws Error(Failure::file).
  void sample(double time, const Particles<D>& particles) override;
  /// The average up to now. Throws Error(Failure::file).
  void close() const;

 private:
  std::filesystem::path path_;
  std::vector<std::string> species_;
};

}  // namespace carom
