// SPDX-License-Identifier: BSD-3-Clause
#include "io/files/directory_lock.h"

#include <fcntl.h>
#include <spdlog/fmt/chrono.h>
#include <sys/file.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <thread>

#include "engine/base/error.h"
#include "io/files/descriptor.h"
#include "io/files/output_directory.h"
#include "io/files/text_file.h"

namespace carom {

namespace fs = std::filesystem;

namespace {

std::string contents(const fs::path& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// The start time of a process in clock ticks since boot: the 22nd field of Linux's /proc/…/stat. Empty: unknown.
/// "ended": a zombie, whose exit status has not been collected yet (the third field is its state).
std::string began(const std::string& process) {
  const std::string all = contents("/proc/" + process + "/stat");
  const auto name_ends = all.rfind(')');
  if (name_ends == std::string::npos) return {};
  std::istringstream fields(all.substr(name_ends + 1));
  std::string field;
  for (int n = 3; n <= 22; ++n) {
    fields >> field;
    if (n == 3 && (field == "Z" || field == "X")) return "ended";
  }
  return field;
}

/// "key value" in each line.
std::map<std::string, std::string> entries(const std::string& text) {
  std::map<std::string, std::string> found;
  std::istringstream in(text);
  for (std::string key, value; in >> key && std::getline(in >> std::ws, value);) found[key] = value;
  return found;
}

/// The entries of a lock; "unknown" for missing ones.
std::map<std::string, std::string> read_lock(const fs::path& path) {
  auto lock = entries(contents(path));
  for (const char* key : {"host", "process", "started", "ticks"}) lock.try_emplace(key, "unknown");
  return lock;
}

bool elsewhere(const std::map<std::string, std::string>& lock) {
  return lock.at("host") != host_name() && lock.at("host") != "unknown";
}

bool at_work_here(const std::map<std::string, std::string>& lock) {
  if (elsewhere(lock)) return false;
  const pid_t process = std::atoi(lock.at("process").c_str());
  if (process <= 0 || (::kill(process, 0) != 0 && errno == ESRCH)) return false;
  const std::string since = began(lock.at("process"));
  return since.empty() || since == lock.at("ticks");
}

}  // namespace

std::string host_name() {
  std::array<char, 256> name{};
  return gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "unknown host";
}

bool run_is_at_work(const fs::path& directory) {
  const auto lock = read_lock(directory / run_file::lock);
  return elsewhere(lock) || at_work_here(lock);
}

DirectoryLock::DirectoryLock(const fs::path& directory, bool take_over) : path_(directory / run_file::lock) {
  make_output_directory(directory);
  // A launcher that was stopped may be gone before its processes are.
  for (int tenths = 0; tenths < 20 && at_work_here(read_lock(path_)); ++tenths)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  const Descriptor folder(::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (folder.is_open())
    ::flock(folder.number(), LOCK_EX);  // without this lock, only two runs that start at the same instant can conflict

  if (fs::exists(fs::symlink_status(path_))) {
    auto lock = read_lock(path_);
    const std::string run =
        fmt::format("process {} on host {}, started {}", lock["process"], lock["host"], lock["started"]);
    if (elsewhere(lock) && !take_over)
      throw Error(
          Failure::file,
          fmt::format("{}: a run on another host has this directory: {}; if it has ended, go on with --continue "
                      "and --take-over or delete {}, else choose another directory with -o",
                      directory.string(), run, path_.string()));
    if (at_work_here(lock))
      throw Error(Failure::file, fmt::format("{}: a run is at work in this directory: {}; wait for its end, or choose "
                                             "another directory with -o",
                                             directory.string(), run));
    warning_ = fmt::format("warning: the run before in this directory was ended from outside ({})", run);
  }
  text_ = fmt::format("host {}\nprocess {}\nstarted {:%Y-%m-%d %H:%M:%S}\nticks {}\n", host_name(), ::getpid(),
                      fmt::localtime(std::time(nullptr)), began("self"));
  write_file_atomically(path_, text_);
}

DirectoryLock::~DirectoryLock() {
  std::error_code ignored;
  if (contents(path_) == text_) fs::remove(path_, ignored);
}

}  // namespace carom
