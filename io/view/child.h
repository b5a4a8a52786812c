// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Another `carom` that works beside this one.

#include <spawn.h>

#include <string>
#include <vector>

#include "io/files/descriptor.h"

namespace carom {

/// This program started again with other arguments, outside of any MPI job. It ends with the object that has it.
class Child {
 public:
  /// Its standard input ends with this process; its standard output is first_line()'s. Throws Error(Failure::file).
  explicit Child(const std::vector<std::string>& arguments);
  /// Sends SIGTERM and waits; SIGKILL to a process that is still there after five seconds, as one that is stopped.
  ~Child();
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  /// What it says first; empty if it ends without.
  std::string first_line() const;

 private:
  Descriptor input_{-1}, output_{-1};
  pid_t process_ = 0;
};

/// Opens an address in the desktop's browser where there is one; returns the file that leads there, to be removed at
/// the end: an address on a command line could be read by other users.
std::string open_in_browser(const std::string& address);

}  // namespace carom
