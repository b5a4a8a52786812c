// SPDX-License-Identifier: BSD-3-Clause
// An abandoned slab restores its initial state.

#include "engine/stepping/slab_watch.h"

#include <gtest/gtest.h>

namespace carom::slab_watch_test {
namespace {

/// A state with fields of particles, a value that the run has registered, and two that the integrator has registered.
struct State {
  State() {
    fields.add("position", x);
    fields.add("mass", mass, Fields::Kind::constant);
    fields.add("counts", counts);
    fields.add_value("steps", steps);
    fields.add_value("debt", debt);
    fields.add_value("lengths", lengths);
  }
  void change() {
    for (double& each : x) each += 0.5;
    for (std::uint32_t& each : counts) each += 1;
    steps += 1;
    debt += 2;
    lengths.push_back(debt);
  }
  Fields fields;
  std::vector<double> x{1, 2, 3}, mass{4, 5, 6};
  std::vector<std::uint32_t> counts{7, 8, 9};
  int steps = 10;
  double debt = 11;
  std::vector<double> lengths{12};
};

TEST(SlabWatch, RestoresTheStateOfTheFirstCut) {
  State s;
  SlabWatch watch(s.fields, 1, [] { return false; }, {});
  for (int slab = 0; slab < 2; ++slab) {
    const std::vector<double> x = s.x, lengths = s.lengths;
    const std::vector<std::uint32_t> counts = s.counts;
    const double debt = s.debt;
    const int steps = s.steps;
    watch.begin();
    for (int piece = 0; piece < 3; ++piece) {
      watch.before_change();
      s.change();
      s.x.resize(2 + static_cast<std::size_t>(piece));  // particles migrate
      s.counts.resize(s.x.size());
    }
    watch.restore();
    EXPECT_EQ(s.x, x);
    EXPECT_EQ(s.counts, counts);
    EXPECT_EQ(s.mass, (std::vector<double>{4, 5, 6}));
    EXPECT_EQ(s.debt, debt);
    EXPECT_EQ(s.lengths, lengths);
    EXPECT_EQ(s.steps, steps + 3);  // counted by the run
    s.change();
    const double after = s.debt;
    watch.restore();  // nothing has been stored since
    EXPECT_EQ(s.debt, after);
  }
}

TEST(SlabWatch, ASlabDoneAtOneStrokeKeepsItsEnd) {
  State s;
  SlabWatch watch(s.fields, 1, [] { return false; }, {});
  watch.begin();
  watch.before_change();
  s.change();
  watch.begin();
  s.change();
  watch.restore();
  EXPECT_EQ(s.debt, 15);
  EXPECT_EQ(s.lengths.size(), 3u);
}

TEST(SlabWatch, IsLeftWhereTheRunIsToStop) {
  State s;
  bool stop = false;
  SlabWatch watch(
      s.fields, 1, [&] { return stop; }, [&] { return stop; });
  watch.begin();
  EXPECT_NO_THROW(watch.before_change());
  EXPECT_NO_THROW(watch.look());
  EXPECT_FALSE(watch.asked_here());
  s.change();
  stop = true;
  EXPECT_THROW(watch.look(), SlabLeft);
  EXPECT_THROW(watch.before_change(), SlabLeft);
  EXPECT_TRUE(watch.asked_here());
  watch.restore();
  EXPECT_EQ(s.debt, 11);
}

}  // namespace
}  // namespace carom::slab_watch_test
