// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Frames of a trajectory in the formats of other programs.
//
// All formats hold the numbers of the trajectory, text in the fewest digits that reproduce them; GSD has single
// precision and its origin in the middle of the box.

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "io/files/text_file.h"
#include "io/files/trajectory_reader.h"

namespace carom {

struct ExportFormat {
  std::string_view name;       ///< the name on the command line
  std::string_view extension;  ///< extension of the file name
  bool one_frame;              ///< holds a single frame only
  /// Writes the frames (indices, at least one) to `out`, which will have the name `file`; returns a message for the
  /// user, or "". Throws Error(Failure::file).
  std::string (*write)(const TrajectoryReader& trajectory, std::span<const std::uint64_t> frames, TextFile& out,
                       const std::filesystem::path& file);
};

/// All formats.
std::span<const ExportFormat> export_formats();

std::string write_extxyz(const TrajectoryReader& trajectory, std::span<const std::uint64_t> frames, TextFile& out,
                         const std::filesystem::path& file);
std::string write_gsd(const TrajectoryReader& trajectory, std::span<const std::uint64_t> frames, TextFile& out,
                      const std::filesystem::path& file);
std::string write_lammps_data(const TrajectoryReader& trajectory, std::span<const std::uint64_t> frames, TextFile& out,
                              const std::filesystem::path& file);
std::string write_xdmf2(const TrajectoryReader& trajectory, std::span<const std::uint64_t> frames, TextFile& out,
                        const std::filesystem::path& file);
std::string write_xdmf(const TrajectoryReader& trajectory, std::span<const std::uint64_t> frames, TextFile& out,
                       const std::filesystem::path& file);

}  // namespace carom
