// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The sub-commands of `carom` that read a deck or print what the program knows. Each returns the exit code of the
// process and throws Error.

#include <filesystem>
#include <string>
#include <vector>

namespace carom {

/// `carom validate`: parses, checks and builds the initial state, and says on stdout what would run.
int validate_command(const std::filesystem::path& deck, const std::vector<std::string>& set);

/// What `carom --version` prints.
std::string version_page();

}  // namespace carom
