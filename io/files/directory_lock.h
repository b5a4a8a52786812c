// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// One run at a time in a directory: the file carom.lock holds the host, process and start time of the active run.
//
// It is read and written while the directory itself is locked (flock), so that only one of two simultaneous starts gets
// it. A process is identified by its number and its start time, since numbers are reused.

#include <filesystem>
#include <string>

namespace carom {

/// The name of this machine.
std::string host_name();

/// Whether a run is active in a directory, according to its lock; a lock of another host counts as active.
bool run_is_at_work(const std::filesystem::path& directory);

class DirectoryLock {
 public:
  /// Makes the directory if it is missing. Throws Error(Failure::file) if another run is active there, or if there is a
  /// lock of another host, whose processes cannot be checked from here. `take_over`: the user says that the run there
  /// has ended.
  explicit DirectoryLock(const std::filesystem::path& directory, bool take_over = false);
  /// Removes the lock.
  ~DirectoryLock();
  DirectoryLock(const DirectoryLock&) = delete;
  DirectoryLock& operator=(const DirectoryLock&) = delete;

  /// A warning if the lock of a run that ended without removing it was replaced; else empty.
  const std::string& warning() const { return warning_; }

 private:
  std::filesystem::path path_;
  std::string text_, warning_;
};

}  // namespace carom
