// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Collects what is wrong with a deck, so that all errors can be reported at once.
//
//   problems.error(place, "radius must be positive (is -1)", "give a number above 0");
//   problems.throw_errors(Failure::deck);

#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"

namespace carom {

/// A place in a deck: a file with line and column (0 = the file as a whole), or a `--set` option.
struct Place {
  std::string source;
  int line = 0, column = 0;

  /// `file:line:column`, `file` or `--set key`.
  std::string text() const;
};

class Problems {
 public:
  void error(const Place& place, const std::string& what, const std::string& remedy);
  /// `message`: "what; remedy", as errors of the engine have it.
  void error(const Place& place, const std::string& message);
  void warning(const Place& place, const std::string& what, const std::string& remedy);
  std::size_t errors() const { return errors_.size(); }
  /// Throws an Error with all errors, one a line, in the order of their places, if there are any.
  void throw_errors(Failure failure) const;
  /// `place: warning: what; remedy`, in the order of their calls.
  std::vector<std::string> warnings() const;

 private:
  struct Problem {
    Place place;
    std::string text;
  };
  std::vector<Problem> errors_, warnings_;
};

/// The candidate closest to `word`, or "" if none is close: Damerau–Levenshtein distance up to a third of the
/// length, at least 2.
std::string nearest(std::string_view word, const std::vector<std::string>& candidates);

/// "; did you mean 'x'?" as a remedy, or all candidates if none is close.
std::string suggestion(std::string_view word, const std::vector<std::string>& candidates);

/// "a, b, c"
std::string join(const std::vector<std::string>& words);

}  // namespace carom
