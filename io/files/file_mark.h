// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A position in a file of a run, from which a continued run writes on.

#include <cstdint>
#include <filesystem>
#include <string>

#include "engine/base/error.h"

namespace carom {

/// The number of bytes of a text and their CRC-32; or the number of rows of an HDF5 file and the CRC-32 of its deck and
/// its last row.
struct FileMark {
  std::uint64_t length = 0, sum = 0;
};

/// The error of a run that cannot be continued because a file differs from what the run wrote; `is`: how.
[[noreturn]] inline void refuse_to_go_on(const std::filesystem::path& file, const std::string& is) {
  throw Error(Failure::file, file.string() + ": " + is +
                                 "; put back the file that the run has written, or start a new run from the "
                                 "checkpoint with carom branch");
}

}  // namespace carom
