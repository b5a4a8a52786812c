// SPDX-License-Identifier: BSD-3-Clause
#include "io/files/output_directory.h"

#include <string>
#include <vector>

#include "engine/base/error.h"

namespace carom {

namespace fs = std::filesystem;

namespace {

[[noreturn]] void fail(const fs::path& directory, const fs::filesystem_error& e) {
  throw Error(Failure::file, directory.string() + ": cannot be the directory for output: " + e.code().message() +
                                 (e.path1().empty() || e.path1() == directory ? "" : " (" + e.path1().string() + ")") +
                                 "; choose another one with -o or output.directory");
}

}  // namespace

void make_output_directory(const fs::path& directory) try {
  fs::create_directories(directory);
} catch (const fs::filesystem_error& e) {
  fail(directory, e);
}

std::optional<fs::path> prepare_output_directory(const fs::path& directory, bool overwrite) try {
  std::optional<fs::path> backup;
  std::vector<std::string> names = {
      run_file::deck,    run_file::trajectory, run_file::thermo,     run_file::events,
      run_file::summary, run_file::log,        run_file::checkpoint, run_file::previous_checkpoint};
  for (const ObservableInfo& info : observables()) names.push_back(run_file::averages(info));
  // What a kill leaves: journals and unfinished `.part` files move with their files.
  const std::size_t files = names.size();
  for (std::size_t n = 0; n < files; ++n)
    for (const char* left : {".journal", ".part"}) names.push_back(names[n] + left);
  for (const std::string& name : names) {
    const fs::file_status is = fs::symlink_status(directory / name);
    if (!fs::exists(is)) continue;
    if (overwrite && (fs::is_regular_file(is) || fs::is_symlink(is))) {
      fs::remove(directory / name);
      continue;
    }
    for (int n = 1; !backup; ++n) {
      // create_directory returns whether the name was free, also if two runs start at once.
      const fs::path candidate = directory / ("backup." + std::to_string(n));
      if (!fs::exists(fs::symlink_status(candidate)) && fs::create_directory(candidate)) backup = candidate;
    }
    fs::rename(directory / name, *backup / name);
  }
  return backup;
} catch (const fs::filesystem_error& e) {
  fail(directory, e);
}

}  // namespace carom
