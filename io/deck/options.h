// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// What the command line of `carom run` and of `carom branch` says.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace carom {

struct RunOptions {
  std::filesystem::path deck;
  std::vector<std::string> set;                 ///< `table.key=value`, in the order given
  std::optional<std::filesystem::path> output;  ///< instead of output.directory; relative to the working directory
  std::optional<std::filesystem::path> go_on;   ///< instead of a deck: the directory of a run to be continued
  std::optional<std::filesystem::path> branch;  ///< instead of a deck: the checkpoint that a new run starts from
  bool take_over = false;                       ///< of a run that is continued: the process on another host has ended
  std::optional<double> max_wall_seconds;       ///< stop early after this much wall time
  double silence = 600;                         ///< seconds after which ranks that do not answer are given up; 0: never
  bool quiet = false;                           ///< no progress line, no banner
  bool view = false;                            ///< a page that shows the run
  bool browser = true;                          ///< of the page: opens a browser where there is a display
  std::uint16_t port = 0;                       ///< of the page; 0: any free one
};

/// Seconds of wall time written hh:mm:ss, mm:ss or ss, fractions allowed; nothing if it is not such a text.
std::optional<double> wall_seconds(std::string_view text);

}  // namespace carom
