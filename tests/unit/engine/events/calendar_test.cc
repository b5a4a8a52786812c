// SPDX-License-Identifier: BSD-3-Clause
#include "engine/events/calendar.h"

#include <gtest/gtest.h>

#include <random>

namespace carom::calendar_test {
namespace {

const auto always = [](const CalendarEntry&) { return true; };

TEST(Calendar, ServesInOrderWhateverIsScheduledMeanwhile) {
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (std::size_t expected : {1ul, 100ul, 100000ul}) {
    Calendar calendar;
    calendar.reset(2.0, expected);
    std::size_t scheduled = 0, served = 0;
    auto push = [&](double time) {
      calendar.push(time, static_cast<std::uint32_t>(scheduled));
      if (time < 2.0) ++scheduled;
    };
    for (int k = 0; k < 3000; ++k) push(3 * uniform(random));  // a third beyond the horizon
    double now = 0;
    while (const CalendarEntry* entry = calendar.top(always)) {
      ASSERT_GE(double{entry->time}, now);
      now = entry->time;
      calendar.pop();
      if (++served % 2 == 0) push(now + (served % 10 == 0 ? 0 : 0.3 * uniform(random)));  // also at the current time
    }
    EXPECT_EQ(served, scheduled);
    EXPECT_GT(served, 3000u);
  }
}

TEST(Calendar, LeavesOutWhatNoLongerHolds) {
  Calendar calendar;
  calendar.reset(1.0, 1000);
  for (std::uint32_t k = 0; k < 1000; ++k) calendar.push(0.9 * ((k * 617) % 1000) / 1000.0, k);
  const auto even = [](const CalendarEntry& entry) { return entry.slot % 2 == 0; };
  std::size_t served = 0;
  double before = -1;
  while (const CalendarEntry* entry = calendar.top(even)) {
    EXPECT_TRUE(even(*entry));
    EXPECT_LT(before, double{entry->time});  // a copy: entries are packed
    before = entry->time;
    calendar.pop();
    ++served;
  }
  EXPECT_EQ(served, 500u);
}

TEST(Calendar, TakesVeryUnevenTimes) {  // bins adapt; some entries have equal times or are far beyond the ring
  Calendar calendar;
  calendar.reset(1e6, 100);
  std::size_t scheduled = 0;
  const auto push = [&](double time) {
    calendar.push(time, 0);
    scheduled += time < 1e6 ? 1 : 0;
  };
  for (int k = 0; k < 200; ++k) push(0.0), push(1e-9 * k), push(5000.0 * k), push(999.0 + 1e-3 * k);
  double now = 0;
  std::size_t served = 0;
  while (const CalendarEntry* entry = calendar.top(always)) {
    ASSERT_GE(double{entry->time}, now);
    now = entry->time;
    calendar.pop();
    if (++served % 3 == 0 && served < 3000) push(now + (served % 2 == 0 ? 1e-6 : 2e5));
  }
  EXPECT_EQ(served, scheduled);
}

TEST(Calendar, KnowsWhatComesNextWithinABin) {
  Calendar calendar;
  calendar.reset(1.0, 1000);
  for (std::uint32_t k = 0; k < 1000; ++k) calendar.push(((k * 617) % 1000) / 1000.0, k);
  std::size_t served = 0, most = 0;
  while (calendar.top(always)) {
    std::vector<std::uint32_t> coming;
    while (const CalendarEntry* entry = calendar.upcoming(coming.size())) coming.push_back(entry->slot);
    ASSERT_FALSE(coming.empty());
    ASSERT_LE(served + coming.size(), 1000u);
    most = std::max(most, coming.size());
    for (const std::uint32_t slot : coming) {
      ASSERT_EQ(std::uint32_t{calendar.top(always)->slot}, slot);
      calendar.pop();
      ++served;
    }
    ASSERT_EQ(calendar.upcoming(0), nullptr);
  }
  EXPECT_EQ(served, 1000u);
  EXPECT_GT(most, 3u);
}

TEST(Calendar, StartsAfresh) {
  Calendar calendar;
  calendar.reset(1.0, 4);
  calendar.push(0.5, 0);
  calendar.top(always);
  calendar.reset(2.0, 4);
  EXPECT_EQ(calendar.top(always), nullptr);
}

}  // namespace
}  // namespace carom::calendar_test
