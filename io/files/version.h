// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A description of this build for --version, the banner of a log and the files of a run.

#include <string>

namespace carom {

/// Version and commit, for instance "1.0.0 (git 1a2b3c4)".
std::string version_string();

/// Compiler, build type and flags, one line.
std::string compiler_string();

/// The libraries in use with their versions, one line.
std::string library_versions();

}  // namespace carom
