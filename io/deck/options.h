// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The options of `carom run` and `carom branch`.

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
  bool take_over = false;                  ///< with go_on: the user says that the process on another host has ended
  std::optional<double> max_wall_seconds;  ///< stop early after this much wall time
  double silence = 600;                    ///< seconds without an answer after which a rank counts as lost; 0: never
  bool quiet = false;                      ///< no progress line, no banner
  bool view = false;                       ///< a page that shows the run
  bool browser = true;                     ///< opens the page in a browser if there is a display
  std::uint16_t port = 0;                  ///< port of the page; 0: any free one
};

/// Seconds of wall time written hh:mm:ss, mm:ss or ss, fractions allowed; nullopt if the text has another form.
std::optional<double> wall_seconds(std::string_view text);

}  // namespace carom
