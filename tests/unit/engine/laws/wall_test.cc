// SPDX-License-Identifier: BSD-3-Clause
// Walls, boundaries and the record of contacts, as all users see them.

#include "engine/laws/wall.h"

#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "engine/laws/box.h"
#include "engine/laws/counters.h"

namespace carom::wall_test {
namespace {

constexpr Boundary W = Boundary::wall, P = Boundary::periodic, O = Boundary::open;

TEST(Walls, OfABox) {
  const Box<3> box{.edges = {3, 4, 5}, .boundary = {W, P, W}};
  const auto walls = box.walls();
  ASSERT_EQ(walls.size(), 4u);
  const Vec<3> x{1, 2, 1.5}, v{0.5, 7, -2};
  const struct {
    Id number;
    const char* name;
    double gap, approach;
    Vec<3> foot;
  } expected[] = {{0, "the lower wall of axis 0", 0.75, 0.5, {0, 2, 1.5}},
                  {1, "the upper wall of axis 0", 1.75, -0.5, {3, 2, 1.5}},
                  {4, "the lower wall of axis 2", 1.25, -2, {1, 2, 0}},
                  {5, "the upper wall of axis 2", 3.25, 2, {1, 2, 5}}};
  for (std::size_t k = 0; k < walls.size(); ++k) {
    EXPECT_EQ(walls[k].number, expected[k].number);
    EXPECT_EQ(box.wall(expected[k].number).offset, walls[k].offset);
    EXPECT_EQ(box.wall_name(walls[k].number), expected[k].name);
    EXPECT_EQ(walls[k].gap(x, 0.25), expected[k].gap);
    EXPECT_EQ(walls[k].along_normal(v), expected[k].approach);
    EXPECT_EQ(walls[k].normal.dot(v), expected[k].approach);
    EXPECT_EQ(walls[k].foot(x), expected[k].foot);
  }
}

TEST(Walls, ToleranceIsOneForAllOfTheBox) {
  const Box<2> box{.edges = {4, 1024}};
  EXPECT_EQ(box.gap_tolerance()(1), 4 * std::numeric_limits<double>::epsilon() * 1024);  // 4 ulp
  EXPECT_DOUBLE_EQ(box.gap_tolerance()(100), 1e-11);
}

TEST(Boundaries, AreFoundByTheirNames) {
  ASSERT_EQ(boundaries().size(), 3u);
  for (const BoundaryInfo& info : boundaries()) {
    EXPECT_EQ(find_boundary(info.name).boundary, info.boundary);
    EXPECT_EQ(find_boundary(info.boundary).name, info.name);
    EXPECT_EQ(info.h5md, info.boundary == P ? "periodic" : "none");
  }
  try {
    find_boundary("soft");
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "unknown boundary 'soft'; give one of: wall, periodic, open");
  }
}

TEST(Boundaries, BoxIsClosedWhereNoAxisIsOpen) {
  EXPECT_TRUE((Box<2>{.boundary = {W, P}}.closed()));
  EXPECT_FALSE((Box<2>{.boundary = {P, O}}.closed()));
}

TEST(ContactTally, AddsUpWhatItsPartsCount) {
  std::vector<Contact<2>> log;
  Counters one, other;
  const Vec<2> zero = Vec<2>::Zero();
  const Contact<2> pair{{.kind = EventKind::pair, .lo = 1, .hi = 2}, zero, zero, zero, {.virial = 0.1}, 3e-16};
  const Contact<2> bounce{{.kind = EventKind::wall, .lo = 1, .hi = 3}, zero, zero, zero, {}, 5e-16};
  one.record(pair, &log);
  one.record(bounce, &log);
  other.record<2>(pair, nullptr);
  one.add(other);
  EXPECT_EQ(one.sphere_sphere, 2u);
  EXPECT_EQ(one.sphere_wall, 1u);
  EXPECT_EQ(one.contacts(), 3u);
  EXPECT_EQ(one.collision_virial.value(), 0.2);
  EXPECT_EQ(one.max_overlap, 5e-16);
  ASSERT_EQ(log.size(), 2u);
  EXPECT_EQ(partners(log[1].key, Box<2>{}), "particle 1 and the upper wall of axis 1");
}

/// A face that moves or is warm is still one wall; a further wall is one, or two if it acts on both sides.
TEST(Walls, EachIsThereOnce) {
  Box<2> box{.edges = {8, 8}, .boundary = {W, P}};
  const auto numbers = [&] {
    std::vector<Id> all;
    for (const Wall<2>& wall : box.walls()) all.push_back(wall.number);
    return all;
  };
  EXPECT_EQ(numbers(), (std::vector<Id>{0, 1}));
  box.add({.name = "x-", .temperature = 2});
  EXPECT_EQ(numbers(), (std::vector<Id>{0, 1}));
  box.add({.name = "near", .normal = {1, 0}, .offset = 1});
  box.add({.name = "middle", .normal = {1, 0}, .offset = 6, .one_sided = false});
  EXPECT_EQ(numbers(), (std::vector<Id>{0, 1, 4, 5, 6}));
}

}  // namespace
}  // namespace carom::wall_test
