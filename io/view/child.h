// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Another `carom` process beside this one.

#include <spawn.h>

#include <string>
#include <vector>

#include "io/files/descriptor.h"

namespace carom {

/// This program, started again with other arguments outside any MPI job. The process ends with this object.
class Child {
 public:
  /// The child's standard input closes when this process ends; first_line() reads its standard output. Throws
  /// Error(Failure::file).
  explicit Child(const std::vector<std::string>& arguments);
  /// Sends SIGTERM and waits; sends SIGKILL if the process (for example a stopped one) is still there after five
  /// seconds.
  ~Child();
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  /// The first line of its output; empty if it ends without output.
  std::string first_line() const;

 private:
  Descriptor input_{-1}, output_{-1};
  pid_t process_ = 0;
};

/// Opens an address in the desktop's browser if there is one; returns the file that redirects to the address, to be
/// removed at the end: an address on a command line could be read by other users.
std::string open_in_browser(const std::string& address);

}  // namespace carom
