#pragma once
// run.log and what a run says on the terminal.
//
// Every line of the log is in the file before the run goes on. A log that cannot be written is an error like that of
// any other file: each member throws Error(Failure::file).

#include <spdlog/logger.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string_view>

namespace carom {

class RunLog {
 public:
  /// Creates the file, or opens it again to go on behind its first `size` bytes. `quiet`: nothing but warnings and
  /// errors goes to the terminal.
  RunLog(const std::filesystem::path& path, bool quiet, std::optional<std::uint64_t> size = {});
  ~RunLog();

  void note(std::string_view text);   ///< to the file
  void say(std::string_view text);    ///< to the file and to stdout
  void warn(std::string_view text);   ///< to the file and to stderr; the text itself says that it is a warning
  void error(std::string_view text);  ///< to the file, as an error; the command prints it when it ends
  /// In bytes.
  std::uint64_t size() const;
  /// Puts everything on the disk.
  void close();

 private:
  class FileSink;
  void log(spdlog::logger& to, spdlog::level::level_enum level, std::string_view text);

  std::shared_ptr<FileSink> sink_;
  std::unique_ptr<spdlog::logger> file_, screen_, warnings_;
};

}  // namespace carom
