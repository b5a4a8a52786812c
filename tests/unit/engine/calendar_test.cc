#include "engine/calendar.h"

#include <gtest/gtest.h>

#include <random>

namespace carom {
namespace {

TEST(Calendar, ServesInOrderWhateverIsScheduledMeanwhile) {
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (std::size_t expected : {1ul, 100ul, 100000ul}) {
    Calendar calendar;
    calendar.reset(2.0, expected);
    std::size_t scheduled = 0, served = 0;
    auto push = [&](double time) {
      calendar.push({time, static_cast<std::uint32_t>(scheduled), 0});
      if (time < 2.0) ++scheduled;
    };
    for (int k = 0; k < 3000; ++k) push(3 * uniform(random));  // a third of them beyond the horizon
    double now = 0;
    while (const CalendarEntry* entry = calendar.top()) {
      ASSERT_GE(entry->time, now);
      now = entry->time;
      calendar.pop();
      if (++served % 2 == 0) push(now + (served % 10 == 0 ? 0 : 0.3 * uniform(random)));  // into the present, too
    }
    EXPECT_EQ(served, scheduled);
    EXPECT_GT(served, 3000u);
  }
}

TEST(Calendar, StartsAfresh) {
  Calendar calendar;
  calendar.reset(1.0, 4);
  calendar.push({0.5, 0, 0});
  calendar.top();
  calendar.reset(2.0, 4);
  EXPECT_EQ(calendar.top(), nullptr);
}

}  // namespace
}  // namespace carom
