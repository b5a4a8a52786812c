// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// thermo.csv: one row per output time, each in the file before the run continues.
//
// Columns: time, step, collisions, then scalar_columns(); reduced units; the fewest digits that reproduce the doubles;
// `nan` if a method has no shadow energy.

#include <filesystem>
#include <optional>
#include <vector>

#include "engine/run/simulation.h"
#include "io/files/text_file.h"

namespace carom {

/// A number about a state that the files of a run show. A new column is declared in thermo.cc, and nowhere else.
template <int D>
struct ScalarColumn {
  const char* name;     ///< in thermo.csv
  const char* element;  ///< name in /observables of the trajectory; null: left out
  double (*of)(const Snapshot<D>&);
  const char* heading = nullptr;  ///< heading in the table of run.log; null: left out
  const char* format = nullptr;   ///< format in that table, with the width of the column: "14.8g"
};

/// All columns, in the order of thermo.csv.
template <int D>
const std::vector<ScalarColumn<D>>& scalar_columns();

/// The point of the run at which a row was written.
struct ThermoPoint {
  double time = 0;
  std::int64_t step = 0;
  std::uint64_t collisions = 0;
};

/// The point of the last whole row of a file; zeros if there is none.
ThermoPoint last_thermo_point(const std::filesystem::path& path);

template <int D>
class ThermoWriter : public Observer<D> {
 public:
  /// Creates the file with its header, or opens it again and continues from the mark. Throws Error(Failure::file).
  explicit ThermoWriter(const std::filesystem::path& path, const std::optional<FileMark>& mark = {});

  /// Appends a row. Throws Error(Failure::file).
  void thermo(const Snapshot<D>& snapshot) override;

  const FileMark& mark() const { return file_.mark(); }
  /// Syncs the file to the disk and closes it. Throws Error(Failure::file).
  void close() { file_.close(); }

 private:
  TextFile file_;
};

}  // namespace carom
