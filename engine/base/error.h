// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Errors that are reported to the user, each with the exit code of the command.

#include <cstdio>
#include <stdexcept>
#include <string>

namespace carom {

/// What went wrong; the value is the exit code of the `carom` command. `interrupted`: stopped on request.
enum class Failure { deck = 2, initial_state = 3, numerical = 4, file = 5, interrupted = 75 };

/// An error; the message says what happened, where, and what to do about it.
class Error : public std::runtime_error {
 public:
  Error(Failure failure, const std::string& message) : std::runtime_error(message), failure_(failure) {}
  Failure failure() const { return failure_; }
  int exit_code() const { return static_cast<int>(failure_); }

 private:
  Failure failure_;
};

/// A number as printed in messages, with at most this many significant digits.
inline std::string short_text(double value, int digits = 6) {
  char text[32];
  std::snprintf(text, sizeof text, "%.*g", digits, value);
  return text;
}

}  // namespace carom
