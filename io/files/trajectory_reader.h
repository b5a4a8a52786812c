// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A trajectory (h5md.h), read frame by frame.
//
//   TrajectoryReader trajectory("runs/five-springs");
//   for (std::uint64_t f = 0; f < trajectory.frames(); ++f) use(trajectory.frame(f).position);

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "io/files/hdf5.h"

namespace carom {

/// Vectors have three columns in any dimension, particle by particle in the order of ids.
struct TrajectoryFrame {
  double time = 0;
  std::int64_t step = 0;
  std::array<double, 3> edges{};           ///< in two dimensions 1 along z
  double tilt = 0;                         ///< of the second edge along the first axis, in [0, edges[0])
  std::vector<double> position, velocity;  ///< positions wrapped into the box
  std::vector<double> spin;                ///< angular velocities; empty if contacts are smooth
  std::vector<std::int32_t> image;
};

/// Throws Error(Failure::file) if an HDF5 file is not a trajectory.
void need_trajectory(const hdf5::File& file);

class TrajectoryReader {
 public:
  /// `path`: the file, or the directory of its run. Throws Error(Failure::file) if it is not a trajectory.
  explicit TrajectoryReader(const std::filesystem::path& path);

  const std::filesystem::path& path() const { return file_.path(); }
  std::size_t particles() const { return species.size(); }
  std::uint64_t frames() const { return frames_; }
  double time(std::uint64_t index) const;
  /// Throws Error(Failure::file).
  TrajectoryFrame frame(std::uint64_t index) const;

  int dimension = 3;
  std::string title;
  std::vector<std::string> boundary;       ///< for each of `dimension` axes: wall, periodic or open
  std::vector<std::string> species_names;  ///< at least one
  std::vector<std::int32_t> species;       ///< for each particle the index of its name
  std::vector<double> mass, radius, charge;
  std::vector<double> moment;                       ///< of inertia; empty if contacts are smooth
  std::vector<std::array<std::uint32_t, 2>> bonds;  ///< ids, which count from 0

 private:
  [[noreturn]] void damaged(const std::string& what) const;
  hdf5::File file_;
  std::uint64_t frames_ = 0;
};

}  // namespace carom
