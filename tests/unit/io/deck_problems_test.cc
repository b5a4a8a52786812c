// SPDX-License-Identifier: BSD-3-Clause
#include "io/deck/deck_problems.h"

#include <gtest/gtest.h>

namespace carom::deck_problems_test {
namespace {

TEST(Nearest, FindsSlipsOfTheFingers) {
  const std::vector<std::string> keys{"radius", "mass", "rest_length", "steps"};
  EXPECT_EQ(nearest("raduis", keys), "radius");  // two letters exchanged
  EXPECT_EQ(nearest("mas", keys), "mass");
  EXPECT_EQ(nearest("restlength", keys), "rest_length");
  EXPECT_EQ(nearest("stepps", keys), "steps");
}

TEST(Nearest, IsSilentWhereNothingIsNear) {
  EXPECT_EQ(nearest("temperature", {"radius", "mass"}), "");
  EXPECT_EQ(nearest("ab", {"xy"}), "");
  EXPECT_EQ(suggestion("temperature", {"radius", "mass"}), "there is: radius, mass");
}

TEST(Problems, AreToldInTheOrderOfTheirPlaces) {
  Problems problems;
  problems.error({"--set a.b"}, "third", "c");
  problems.error({"deck", 9, 1}, "second", "b");
  problems.error({"deck", 2, 7}, "first", "a");
  try {
    problems.throw_errors(Failure::initial_state);
    FAIL() << "nothing was thrown";
  } catch (const Error& e) {
    EXPECT_STREQ(e.what(), "deck:2:7: error: first; a\ndeck:9:1: error: second; b\n--set a.b: error: third; c");
    EXPECT_EQ(e.exit_code(), 3);
  }
}

TEST(Problems, WarningsAreNoErrors) {
  Problems problems;
  problems.warning({"deck", 1, 2}, "odd", "look");
  problems.throw_errors(Failure::deck);
  EXPECT_EQ(problems.warnings(), std::vector<std::string>{"deck:1:2: warning: odd; look"});
}

}  // namespace
}  // namespace carom::deck_problems_test
