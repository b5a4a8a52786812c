// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// run.log, and the messages of a run on the terminal.
//
// Every line begins with the time, and the first line of a day with the date. Every line of the log is in the file
// before the run continues. A log that cannot be written is an error, as for any other file: each member throws
// Error(Failure::file).

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "io/files/text_file.h"

namespace carom {

class RunLog {
 public:
  /// Creates the file, or opens it again and continues from the mark. `quiet`: only warnings and errors go to the
  /// terminal. `silent`: nothing does.
  RunLog(const std::filesystem::path& path, bool quiet, const std::optional<FileMark>& mark = {}, bool silent = false)
      : file_(path, mark), quiet_(quiet || silent), silent_(silent) {}

  void note(std::string_view text);   ///< to the file
  void say(std::string_view text);    ///< to the file and to stdout
  void warn(std::string_view text);   ///< to the file and to stderr; the text itself says that it is a warning
  void error(std::string_view text);  ///< to the file, as an error; the command prints it when it ends
  const FileMark& mark() const { return file_.mark(); }
  /// Syncs the file to the disk and closes it.
  void close() { file_.close(); }

 private:
  TextFile file_;
  std::string day_;  // of the last line, which the next ones need not repeat
  bool quiet_, silent_;
};

}  // namespace carom
