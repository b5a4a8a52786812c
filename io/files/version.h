// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// What this build is: for --version, the banner of a log and the files a run leaves.

#include <string>

namespace carom {

/// Version and commit, for instance "1.0.0 (git 1a2b3c4)".
std::string version_string();

/// Compiler, build type and flags, one line.
std::string compiler_string();

/// The libraries at work with their versions, one line.
std::string library_versions();

}  // namespace carom
