// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The files that grow during a run, opened and closed together.

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

/// An observer due at the times of the files on another rank, so that all ranks stop at these times.
template <int D>
class SamplingTimes : public Observer<D> {
 public:
  explicit SamplingTimes(const Sampling& sampling) : sampling_(sampling) {}
  Sampling sampling() const override { return sampling_; }

 private:
  Sampling sampling_;
};

/// Runs an action and ignores its errors, while another error is being reported.
void at_best(auto&& action) {
  try {
    action();
  } catch (const std::exception&) {
  }
}

/// Positions in the files of a run, for cutting them back and continuing.
struct FileMarks {
  FileMark frames{}, thermo{};
  EventMark events{};
  void archive(Archive& archive) { archive(frames, thermo, events); }
};

/// Throws Error(Failure::file), which names the file, unless the files of a run exist and match the marks. Changes
/// nothing.
void check_files(const Deck& deck, const FileMarks& marks, const FileMark& log);

template <int D>
class RunFiles {
 public:
  /// Creates them in deck.output.directory, or opens the files of the same run again and cuts them back to the marks.
  /// Throws Error(Failure::file).
  RunFiles(const Deck& deck, const System<D>& system, const std::optional<FileMarks>& marks = {});

  /// Writes all buffered data, which then survive the end of the process; returns the positions. Throws
  /// Error(Failure::file).
  FileMarks mark();

  /// Adds the files as observers to the run. They must outlive it.
  void add_to(Simulation<D>& simulation);

  /// Writes all buffered data and closes. Throws Error(Failure::file).
  void close();

  /// close() for a failed run: closes each file and ignores further errors.
  void close_after_failure();

  /// Calls action(name, average) for each average; averages without a sample are left out.
  void for_each_average(auto&& action) const {
    for (const auto& one : averages_)
      if (one.average().samples() > 0) action(one.path().stem().string(), one.average());
  }

  /// The values of the averages per species, for the summary.
  std::vector<SpeciesValue> species_values() const;

 private:
  void for_each(auto&& action);

  TrajectoryWriter<D> trajectory_;
  ThermoWriter<D> thermo_;
  std::unique_ptr<EventWriter<D>> events_;  // null without output.events
  std::vector<AverageWriter<D>> averages_;
};

}  // namespace carom
