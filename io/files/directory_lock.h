// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// One run at a time in a directory: the file carom.lock with the host, process and start of the run that is at work.
//
// It is looked at and written while the directory itself is locked (flock), so that of two runs that start at once one
// gets it. A process is the one that is named if it has that number and began at that time: numbers come again.

#include <filesystem>
#include <string>

namespace carom {

/// The name of this machine.
std::string host_name();

/// Whether a run is at work in a directory, as its lock says; one that stands there for another host counts.
bool run_is_at_work(const std::filesystem::path& directory);

class DirectoryLock {
 public:
  /// Makes the directory where it is missing. Throws Error(Failure::file) if another run is at work there, or one on
  /// another host has left its lock: whether that has ended cannot be told from here. `take_over`: it has.
  explicit DirectoryLock(const std::filesystem::path& directory, bool take_over = false);
  /// Takes the lock away.
  ~DirectoryLock();
  DirectoryLock(const DirectoryLock&) = delete;
  DirectoryLock& operator=(const DirectoryLock&) = delete;

  /// Where a run has ended without taking its lock away, and was replaced: a warning that says so; else empty.
  const std::string& warning() const { return warning_; }

 private:
  std::filesystem::path path_;
  std::string text_, warning_;
};

}  // namespace carom
