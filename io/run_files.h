#pragma once
// The files that grow while a run goes on, opened and closed together.

#include <filesystem>
#include <memory>
#include <vector>

#include "engine/simulation.h"
#include "io/averages.h"
#include "io/deck.h"
#include "io/events.h"
#include "io/h5md.h"
#include "io/thermo.h"

namespace carom {

/// The times at which the files need the particles, besides frames and rows.
std::vector<Sampling> samplings(const OutputConfig& output);

/// Looks at the particles when the files of another rank do, so that all ranks stop at the same times.
template <int D>
class Onlooker : public Observer<D> {
 public:
  explicit Onlooker(const Sampling& sampling) : sampling_(sampling) {}
  Sampling sampling() const override { return sampling_; }

 private:
  Sampling sampling_;
};

template <int D>
class RunFiles {
 public:
  /// Creates them in deck.output.directory. Throws Error(Failure::file).
  RunFiles(const Deck& deck, const System<D>& system);

  /// Adds them as observers to the run. They must outlive it.
  void add_to(Simulation<D>& simulation);

  /// Writes what is left and closes. Throws Error(Failure::file).
  void close();

  /// The same for a run that has failed: each file is closed as well as it can be.
  void close_after_failure();

  /// g at contact as far as it was measured, for the summary.
  std::vector<ContactValue> contact_values() const;

 private:
  TrajectoryWriter<D> trajectory_;
  ThermoWriter<D> thermo_;
  // Null where the deck does not want them.
  std::unique_ptr<EventWriter<D>> events_;
  std::unique_ptr<RdfWriter<D>> rdf_;
  std::unique_ptr<MsdWriter<D>> msd_;
};

}  // namespace carom
