#include "io/files/output_directory.h"

#include <string>
#include <vector>

#include "engine/base/error.h"

namespace carom {

namespace fs = std::filesystem;

std::optional<fs::path> prepare_output_directory(const fs::path& directory) try {
  fs::create_directories(directory);
  std::optional<fs::path> backup;
  std::vector<std::string> names = {run_file::deck,   run_file::trajectory, run_file::thermo,
                                    run_file::events, run_file::summary,    run_file::log};
  for (const ObservableInfo& info : observables()) names.push_back(run_file::averages(info));
  for (const std::string& name : names) {
    if (!fs::exists(fs::symlink_status(directory / name))) continue;
    for (int n = 1; !backup; ++n) {
      // create_directory returns whether the name was free, also if two runs start at once.
      const fs::path candidate = directory / ("backup." + std::to_string(n));
      if (!fs::exists(fs::symlink_status(candidate)) && fs::create_directory(candidate)) backup = candidate;
    }
    fs::rename(directory / name, *backup / name);
  }
  return backup;
} catch (const fs::filesystem_error& e) {
  throw Error(Failure::file, directory.string() + ": cannot be the directory for output: " + e.code().message() +
                                 (e.path1().empty() || e.path1() == directory ? "" : " (" + e.path1().string() + ")") +
                                 "; choose another one with -o or output.directory");
}

}  // namespace carom
