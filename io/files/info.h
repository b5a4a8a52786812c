// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// `carom info FILE`: describes a trajectory, a file of events, a checkpoint or the directory of a run.

#include <filesystem>
#include <string>

namespace carom {

/// The description as text for the terminal; for a directory, the description of each of these files in it. Throws
/// Error(Failure::file) if there is nothing to describe.
std::string describe_file(const std::filesystem::path& file);

/// Prints it and returns the exit code.
int info_command(const std::filesystem::path& file);

}  // namespace carom
