// SPDX-License-Identifier: BSD-3-Clause
#include "io/files/log.h"

#include <spdlog/fmt/chrono.h>
#include <spdlog/fmt/fmt.h>

#include <cstdio>
#include <ctime>
#include <string>

namespace carom {
namespace {

/// A closed terminal is not an error of the run.
void show(std::FILE* to, std::string_view text) {
  std::fwrite(text.data(), 1, text.size(), to);
  std::fputc('\n', to);
  std::fflush(to);
}

}  // namespace

void RunLog::note(std::string_view text) {
  const std::tm now = fmt::localtime(std::time(nullptr));
  const std::string day = fmt::format("{:%Y-%m-%d} ", now);
  file_.append(fmt::format("{}{:%H:%M:%S}  {}\n", day == day_ ? "" : day, now, text));
  day_ = day;
}

void RunLog::say(std::string_view text) {
  if (!quiet_) show(stdout, text);
  note(text);
}

void RunLog::warn(std::string_view text) {
  if (!silent_) show(stderr, text);
  note(text);
}

void RunLog::error(std::string_view text) { note(std::string("error: ").append(text)); }

}  // namespace carom
