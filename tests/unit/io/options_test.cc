// SPDX-License-Identifier: BSD-3-Clause
#include "io/deck/options.h"

#include <gtest/gtest.h>

namespace carom::options_test {
namespace {

TEST(WallSeconds, ReadsHoursMinutesSeconds) {
  EXPECT_EQ(wall_seconds("00:05:00"), 300);
  EXPECT_EQ(wall_seconds("100:00:01"), 360001);
  EXPECT_EQ(wall_seconds("01:30"), 90);
  EXPECT_EQ(wall_seconds("0.25"), 0.25);
  EXPECT_EQ(wall_seconds("00:00:01.5"), 1.5);
}

TEST(WallSeconds, RefusesEverythingElse) {
  for (const char* text : {"", ":", "soon", "1:2:3:4", "-5", "00:-1:00", "1.5:00", "00:05:", "1e3", "inf", "nan", "5 "})
    EXPECT_FALSE(wall_seconds(text)) << text;
}

}  // namespace
}  // namespace carom::options_test
