// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// thermo.csv: one row an output time, each in the file before the run goes on.
//
// Columns: time, step, collisions, kinetic, potential, total, shadow, max_energy_error, momentum_x, momentum_y[,
// momentum_z], temperature, pressure; reduced units; the fewest digits that give the doubles back; `nan` where a
// method has no shadow energy.

#include <filesystem>
#include <optional>

#include "engine/run/simulation.h"
#include "io/files/text_file.h"

namespace carom {

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
