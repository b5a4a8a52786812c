// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// `carom convert RUN --to FORMAT`

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace carom {

struct ConvertOptions {
  std::filesystem::path run;                    ///< directory or trajectory
  std::string format;                           ///< a name of export_formats()
  std::optional<std::filesystem::path> output;  ///< default: beside the trajectory, with the extension of the format
  std::string frames;                           ///< "7", "-1", "0:100:10" as slices in Python; empty: all, or the last
};

/// The indices of the chosen frames. Throws Error(Failure::deck) if the choice is malformed or selects no frame.
std::vector<std::uint64_t> chosen_frames(const std::string& choice, std::uint64_t frames);

/// Writes the file, says on stdout what it wrote, and returns the exit code. Throws Error.
int convert_command(const ConvertOptions& options);

/// The names of all formats.
std::vector<std::string> format_names();

}  // namespace carom
