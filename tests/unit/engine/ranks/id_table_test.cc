// SPDX-License-Identifier: BSD-3-Clause
// The table of slots by id gives the results of a map, for any collisions of ids.

#include "engine/ranks/id_table.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

namespace carom::id_table_test {
namespace {

TEST(IdTable, DoesWhatAMapDoes) {
  std::mt19937 random(7);
  for (const std::size_t most : {1, 5, 100}) {
    IdTable table(most);
    std::map<Id, Slot> map;
    for (int step = 0; step < 20000; ++step) {
      const auto id = static_cast<Id>(random() % (3 * most));
      if (map.contains(id)) {
        table.remove(id);
        map.erase(id);
      } else if (map.size() < most) {
        table.add(id, static_cast<Slot>(step));
        map[id] = static_cast<Slot>(step);
      }
      const auto other = static_cast<Id>(random() % (3 * most));
      ASSERT_EQ(table.find(other), map.contains(other) ? map[other] : IdTable::kNowhere);
    }
  }
}

}  // namespace
}  // namespace carom::id_table_test
