// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// `carom view`, `carom run --view` and `carom demo`: show runs in a browser.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace carom {

class Child;

struct ViewOptions {
  std::vector<std::filesystem::path> runs;         ///< directories; shown side by side
  std::optional<std::filesystem::path> export_to;  ///< writes the page with its data to this file instead
  std::uint64_t most_megabytes = 64;               ///< largest size of the exported file
  std::uint16_t port = 0;                          ///< 0: any free one
  bool browser = true;                             ///< opens a browser if there is a display
  bool awaited = false;                            ///< the runs are about to begin
  bool led = false;                                ///< started by `carom run --view`: awaited; ends with standard input
};

/// Serves the page until Ctrl-C, or exports it. Throws Error: no run in a directory, or a damaged one (file); the port
/// is taken, or an export would be too large (deck).
int view_command(const ViewOptions& options);

/// Runs psa and edda from one start and shows them side by side until Ctrl-C; files go to this directory or a temporary
/// one.
int demo_command(const std::optional<std::filesystem::path>& directory, const ViewOptions& options);

/// The page of a run that is about to begin, served by a process of its own.
class RunView {
 public:
  /// Prints its address. Throws Error(Failure::deck) if it cannot be served.
  RunView(const std::filesystem::path& directory, std::uint16_t port, bool browser);
  ~RunView();
  RunView(const RunView&) = delete;
  RunView& operator=(const RunView&) = delete;
  /// In a terminal: leaves the page open until Ctrl-C.
  void stay() const;

 private:
  std::unique_ptr<Child> server_;
};

/// The page with its data (export.cc): reads all its data from these runs. Throws Error.
void export_page(const ViewOptions& options);

/// The page, and the deck of the demo: put into the program when it is built.
extern const char* const kPage;
extern const char* const kDemoDeck;

}  // namespace carom
