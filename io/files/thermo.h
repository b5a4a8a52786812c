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

template <int D>
class ThermoWriter : public Observer<D> {
 public:
  /// Creates the file with its header, or opens it again to go on behind its first so many bytes. Throws
  /// Error(Failure::file).
  explicit ThermoWriter(const std::filesystem::path& path, std::optional<std::uint64_t> size = {});

  /// Appends a row. Throws Error(Failure::file).
  void thermo(const Snapshot<D>& snapshot) override;

  /// In bytes.
  std::uint64_t size() const { return file_.size(); }
  /// Puts everything on the disk. Throws Error(Failure::file).
  void close() { file_.close(); }

 private:
  TextFile file_;
};

}  // namespace carom
