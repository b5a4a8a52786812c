// SPDX-License-Identifier: BSD-3-Clause
// Two ranks that have a particle compute equal hashes of its path if its events are equal, and only then.

#include "engine/stepping/path_hash.h"

#include <gtest/gtest.h>

namespace carom::path_hash_test {
namespace {

Particles<3> particles_of(std::vector<Id> ids) {
  Particles<3> p;
  p.x.resize(ids.size());
  p.mass.assign(ids.size(), 1.0);
  p.id = std::move(ids);
  return p;
}

/// The hashes of particles 3, 6 and 9 on a rank with particles of these ids, after events given by local numbers.
std::array<std::uint64_t, 3> words(const std::vector<Id>& ids, const std::vector<EventKey<3>>& events) {
  const Particles<3> p = particles_of(ids);
  PathHashes<3> hashes(p);
  for (const EventKey<3>& key : events) hashes.add(key);
  std::array<std::uint64_t, 3> by_id{};
  for (std::size_t i = 0; i < ids.size(); ++i)
    if (ids[i] % 3 == 0) by_id[ids[i] / 3 - 1] = hashes.words()[i];
  return by_id;
}

const EventKey<3> kPair{.time = 0.5, .generation = 2, .lo = 0, .hi = 1, .image = {0, -1, 2}};
const EventKey<3> kWall{.time = 0.75, .kind = EventKind::wall, .lo = 0, .hi = 1};

TEST(PathHash, DoesNotDependOnWhichOtherParticlesARankHas) {
  const auto here = words({3, 6, 9}, {kPair, kWall});
  std::vector<EventKey<3>> events{kPair, kWall};
  for (EventKey<3>& key : events) {
    ++key.lo;
    if (key.kind == EventKind::pair) key.hi += 2;
  }
  EXPECT_EQ(words({1, 3, 5, 6, 9}, {events[0], events[1]}), here);
}

TEST(PathHash, OfAPairBelongsToBothPartnersAndOfAWallToOne) {
  const auto none = words({3, 6, 9}, {}), pair = words({3, 6, 9}, {kPair}), wall = words({3, 6, 9}, {kWall});
  EXPECT_NE(pair[0], none[0]);
  EXPECT_NE(pair[1], none[1]);
  EXPECT_EQ(pair[2], none[2]);
  EXPECT_NE(wall[0], none[0]);
  EXPECT_EQ(wall[1], none[1]);
}

TEST(PathHash, DependsOnEachPartOfTheKeyAndOnTheOrder) {
  const auto right = words({3, 6, 9}, {kPair, kWall});
  const auto with = [](auto&& change) {
    std::vector<EventKey<3>> events{kPair, kWall};
    change(events);
    return words({3, 6, 9}, events)[0];
  };
  EXPECT_NE(with([](auto& events) { events[0].time = std::nextafter(0.5, 1); }), right[0]);
  EXPECT_NE(with([](auto& events) { events[0].generation = 3; }), right[0]);
  EXPECT_NE(with([](auto& events) { events[0].hi = 2; }), right[0]);
  EXPECT_NE(with([](auto& events) { events[1].hi = 2; }), right[0]);
  for (std::size_t k = 0; k < 3; ++k)
    EXPECT_NE(with([k](auto& events) { events[0].image[k] += 1; }), right[0]) << "axis " << k;
  EXPECT_NE(with([](auto& events) { std::swap(events[0], events[1]); }), right[0]);
  EXPECT_NE(with([](auto& events) { events.pop_back(); }), right[0]);
}

}  // namespace
}  // namespace carom::path_hash_test
