// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// `carom info FILE`: what is in a trajectory or in a file of events.

#include <filesystem>
#include <string>

namespace carom {

/// The answer as text for the terminal. Throws Error(Failure::file) for anything that is not such a file.
std::string describe_file(const std::filesystem::path& file);

/// Prints it and returns the exit code.
int info_command(const std::filesystem::path& file);

}  // namespace carom
