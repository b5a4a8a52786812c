// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// thermo.csv: one row an output time, each in the file before the run goes on.
//
// Columns: time, step, collisions, then scalar_columns(); reduced units; the fewest digits that give the doubles back;
// `nan` where a method has no shadow energy.

#include <filesystem>
#include <optional>
#include <vector>

#include "engine/run/simulation.h"
#include "io/files/text_file.h"

namespace carom {

/// A number about a state that the files of a run show. A new one is declared in thermo.cc, and nowhere else.
template <int D>
struct ScalarColumn {
  const char* name;     ///< in thermo.csv
  const char* element;  ///< in /observables of the trajectory; null: not there
  double (*of)(const Snapshot<D>&);
  const char* heading = nullptr;  ///< in the table of run.log; null: not there
  const char* format = nullptr;   ///< there, with the width of the column: "14.8g"
};

/// In the order of thermo.csv.
template <int D>
const std::vector<ScalarColumn<D>>& scalar_columns();

/// When a row was written.
struct ThermoPoint {
  double time = 0;
  std::int64_t step = 0;
  std::uint64_t collisions = 0;
};

/// The point of the last whole row of a file; zeros where there is none.
ThermoPoint last_thermo_point(const std::filesystem::path& path);

template <int D>
class ThermoWriter : public Observer<D> {
 public:
  /// Creates the file with its header, or opens it again to go on from the mark. Throws Error(Failure::file).
  explicit ThermoWriter(const std::filesystem::path& path, const std::optional<FileMark>& mark = {});

  /// Appends a row. Throws Error(Failure::file).
  void thermo(const Snapshot<D>& snapshot) override;

  const FileMark& mark() const { return file_.mark(); }
  /// Puts everything on the disk. Throws Error(Failure::file).
  void close() { file_.close(); }

 private:
  TextFile file_;
};

}  // namespace carom
