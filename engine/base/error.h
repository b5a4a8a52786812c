// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Errors that reach the user. Each knows which exit code the command ends with.

#include <cstdio>
#include <stdexcept>
#include <string>

namespace carom {

/// What went wrong; the value is the exit code of the `carom` command.
enum class Failure { deck = 2, initial_state = 3, numerical = 4, file = 5 };

/// An error with what happened, where, and what to do about it, all in its message.
class Error : public std::runtime_error {
 public:
  Error(Failure failure, const std::string& message) : std::runtime_error(message), failure_(failure) {}
  Failure failure() const { return failure_; }
  int exit_code() const { return static_cast<int>(failure_); }

 private:
  Failure failure_;
};

/// A number as messages show it, with so many digits, whatever its size.
inline std::string short_text(double value, int digits = 6) {
  char text[32];
  std::snprintf(text, sizeof text, "%.*g", digits, value);
  return text;
}

}  // namespace carom
