// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The files that grow while a run goes on, opened and closed together.

#include <exception>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "engine/run/simulation.h"
#include "io/deck/deck.h"
#include "io/files/averages.h"
#include "io/files/events.h"
#include "io/files/h5md.h"
#include "io/files/thermo.h"

namespace carom {

/// Looks at the particles when the files of another rank do, so that all ranks stop at the same times.
template <int D>
class SamplingTimes : public Observer<D> {
 public:
  explicit SamplingTimes(const Sampling& sampling) : sampling_(sampling) {}
  Sampling sampling() const override { return sampling_; }

 private:
  Sampling sampling_;
};

/// Does something that may fail while another failure is being reported: only the first one counts.
void at_best(auto&& action) {
  try {
    action();
  } catch (const std::exception&) {
  }
}

/// Where the files of a run stand: what is needed to cut them back and to go on.
struct FileMarks {
  FileMark frames{}, thermo{};
  EventMark events{};
  void archive(Archive& archive) { archive(frames, thermo, events); }
};

/// Throws Error(Failure::file), which names the file, unless the files of a run are there and have what they had at the
/// marks. Changes nothing.
void check_files(const Deck& deck, const FileMarks& marks, const FileMark& log);

template <int D>
class RunFiles {
 public:
  /// Creates them in deck.output.directory, or opens those of the same run again and cuts off what is behind the marks.
  /// Throws Error(Failure::file).
  RunFiles(const Deck& deck, const System<D>& system, const std::optional<FileMarks>& marks = {});

  /// Writes what waits; the files then hold what has been shown to them, and survive the end of the process. Throws
  /// Error(Failure::file).
  FileMarks mark();

  /// Adds them as observers to the run. They must outlive it.
  void add_to(Simulation<D>& simulation);

  /// Writes what is left and closes. Throws Error(Failure::file).
  void close();

  /// The same for a run that has failed: each file is closed as well as it can be.
  void close_after_failure();

  /// Calls action(name, average) for each average; those without a sample are left out.
  void for_each_average(auto&& action) const {
    for (const auto& one : averages_)
      if (one.average().samples() > 0) action(one.path().stem().string(), one.average());
  }

  /// What the averages say of species, for the summary.
  std::vector<SpeciesValue> species_values() const;

 private:
  void for_each(auto&& action);

  TrajectoryWriter<D> trajectory_;
  ThermoWriter<D> thermo_;
  std::unique_ptr<EventWriter<D>> events_;  // null where without output.events
  std::vector<AverageWriter<D>> averages_;
};

}  // namespace carom
