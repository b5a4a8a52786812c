// SPDX-License-Identifier: BSD-3-Clause
// Particles move with all their fields to each rank that needs them, and are sorted by their ids there.

#include "engine/ranks/migration.h"

#include <gtest/gtest.h>

namespace carom::migration_test {
namespace {

/// The particles of a rank, with a field in addition to those of a system.
struct Known {
  Known() {
    fields.add("position", p.x);
    fields.add("mass", p.mass);
    fields.add("other", other);
  }
  void add(Id id, bool ghost) {
    p.id.push_back(id);
    p.ghost.push_back(ghost);
    p.x.emplace_back(id, -1.0 * id);
    p.mass.push_back(10.0 + id);
    other.push_back(100 + id);
  }
  void expect_ids(const std::vector<Id>& ids) const {
    ASSERT_EQ(p.size(), ids.size());
    for (Id i = 0; i < ids.size(); ++i) {
      EXPECT_EQ(p.id_of(i), ids[i]);
      EXPECT_EQ(p.x[i], Vec<2>(ids[i], -1.0 * ids[i]));
      EXPECT_EQ(p.mass[i], 10.0 + ids[i]);
      EXPECT_EQ(other[i], 100 + ids[i]);
      EXPECT_TRUE(p.owns(i));
    }
  }
  Particles<2> p;
  std::vector<std::uint32_t> other;
  Fields fields;
};

TEST(Migration, BringsOwnParticlesWithTheirFieldsAndDoesNotSendThoseThatStay) {
  for (const bool stays : {false, true}) {
    Known one, two;
    for (const Id id : {0u, 3u, 4u, 7u}) one.add(id, id == 3);
    for (const Id id : {1u, 3u, 4u, 6u}) two.add(id, id == 4);
    const auto by_place = [](const Vec<2>& x, auto&& visit) {
      if (x[0] < 5) visit(0);
      if (x[0] > 2) visit(1);
    };
    std::vector<Fields::Arrival> stay[2];
    const auto pack = [&](const Known& from, std::size_t here) {
      return stays ? pack_own(from.fields, from.p, {2, 2}, by_place, here, &stay[here])
                   : pack_own(from.fields, from.p, {2, 2}, by_place);
    };
    const auto from_one = pack(one, 0), from_two = pack(two, 1);
    EXPECT_EQ(from_one[0].empty(), stays);
    EXPECT_EQ(from_two[1].empty(), stays);
    receive_particles(one.fields, one.p, {from_one[0], from_two[0]}, 6, stay[0]);
    receive_particles(two.fields, two.p, {from_one[1], from_two[1]}, 6, stay[1]);
    one.expect_ids({0, 1, 3, 4});
    two.expect_ids({3, 4, 6, 7});
  }
}

TEST(Migration, NeedsNoIdsWhereAllAreKnown) {
  Known one;
  for (const Id id : {2u, 0u, 1u}) one.add(id, false);
  const auto messages = pack_own(one.fields, one.p, {3}, [](const Vec<2>&, auto&& visit) { visit(0); });
  receive_particles(one.fields, one.p, messages, 3);
  EXPECT_TRUE(one.p.id.empty());
  one.expect_ids({0, 1, 2});
}

}  // namespace
}  // namespace carom::migration_test
