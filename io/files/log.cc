#include "io/files/log.h"

#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/sinks/stdout_sinks.h>

#include <exception>
#include <mutex>
#include <utility>

#include "io/files/text_file.h"

namespace carom {

/// spdlog swallows what a sink throws; this one keeps it for RunLog to throw again.
class RunLog::FileSink : public spdlog::sinks::base_sink<std::mutex> {
 public:
  FileSink(const std::filesystem::path& path, std::optional<std::uint64_t> size) : file_(path, size) {}
  std::uint64_t size() const { return file_.size(); }
  void rethrow_failure() {
    if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
  }
  void close() { file_.close(); }

 private:
  void sink_it_(const spdlog::details::log_msg& message) override {
    try {
      spdlog::memory_buf_t line;
      formatter_->format(message, line);
      file_.append({line.data(), line.size()});
    } catch (...) {
      failure_ = std::current_exception();
    }
  }
  void flush_() override {}

  TextFile file_;
  std::exception_ptr failure_;
};

RunLog::RunLog(const std::filesystem::path& path, bool quiet, std::optional<std::uint64_t> size)
    : sink_(std::make_shared<FileSink>(path, size)) {
  auto to_stdout = std::make_shared<spdlog::sinks::stdout_sink_mt>();
  auto to_stderr = std::make_shared<spdlog::sinks::stderr_sink_mt>();
  if (quiet) to_stdout->set_level(spdlog::level::off);
  file_ = std::make_unique<spdlog::logger>("file", sink_);
  screen_ = std::make_unique<spdlog::logger>("screen", spdlog::sinks_init_list{sink_, to_stdout});
  warnings_ = std::make_unique<spdlog::logger>("warnings", spdlog::sinks_init_list{sink_, to_stderr});
  sink_->set_pattern("%Y-%m-%d %H:%M:%S  %v");
  to_stdout->set_pattern("%v");
  to_stderr->set_pattern("%v");
}

RunLog::~RunLog() = default;

void RunLog::note(std::string_view text) { log(*file_, spdlog::level::info, text); }
void RunLog::say(std::string_view text) { log(*screen_, spdlog::level::info, text); }
void RunLog::warn(std::string_view text) { log(*warnings_, spdlog::level::warn, text); }
void RunLog::error(std::string_view text) { log(*file_, spdlog::level::err, std::string("error: ").append(text)); }

std::uint64_t RunLog::size() const { return sink_->size(); }

void RunLog::close() { sink_->close(); }

void RunLog::log(spdlog::logger& to, spdlog::level::level_enum level, std::string_view text) {
  to.log(level, text);
  sink_->rethrow_failure();
}

}  // namespace carom
