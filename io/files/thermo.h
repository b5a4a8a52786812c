// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// thermo.csv: one row per output time, each in the file before the run continues.
//
// Its columns are declared in thermo.cc, and nowhere else: the trajectory, run.log, Python, the page and `carom
// methods` show them, too. Reduced units; the fewest digits that reproduce the doubles; `nan` if a method has no shadow
// energy.

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "engine/run/simulation.h"
#include "io/files/text_file.h"

namespace carom {

/// A chart of the page; columns of the same chart share its axes.
struct ColumnChart {
  const char* name;
  const char* title;
  bool logarithmic = false;
};

enum class ColumnKind { number, count, vector };

template <int D>
struct Column {
  const char* name;  ///< in thermo.csv; for each axis of a vector, _x, _y or _z is appended
  ColumnKind kind;
  const char* unit;
  const char* meaning;
  double (*of)(const Snapshot<D>&, int axis);  ///< `axis` is that of a vector
  const char* python;                          ///< property of carom.Simulation; null: none
  const char* element;                         ///< name in /observables of the trajectory; null: left out
  const char* format = nullptr;                ///< in the table of run.log, with the width: "14.8g"; null: left out
  const ColumnChart* chart = nullptr;          ///< on the page; null: none
  const char* heading = name;                  ///< in the table of run.log

  int components() const { return kind == ColumnKind::vector ? D : 1; }
  const char* suffix(int axis) const { return components() == 1 ? "" : std::array{"_x", "_y", "_z"}.at(axis); }
};

/// All columns, in the order of thermo.csv.
template <int D>
const std::vector<Column<D>>& columns();

/// The columns as a text for the manual.
std::string columns_page();

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
  /// Creates the file with its header, which has a column for each wall of the box, or opens it again and continues
  /// from the mark. Throws Error(Failure::file).
  ThermoWriter(const std::filesystem::path& path, const Box<D>& box, const std::optional<FileMark>& mark = {});

  /// Appends a row. Throws Error(Failure::file).
  void thermo(const Snapshot<D>& snapshot) override;

  const FileMark& mark() const { return file_.mark(); }
  /// Syncs the file to the disk and closes it. Throws Error(Failure::file).
  void close() { file_.close(); }

 private:
  TextFile file_;
  std::vector<std::size_t> column_of_wall_;  // in the order of Box::walls(); both sides of a wall have one column
  std::size_t wall_columns_ = 0;
};

}  // namespace carom
