// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Compares the statistics of two runs of one system, on other ranks or continued: every number that describes the
// motion.

#include <gtest/gtest.h>

#include <cmath>

#include "engine/run/simulation.h"

namespace carom::test {

inline bool same(const Overlap& a, const Overlap& b) {
  return a.depth == b.depth && a.length == b.length && a.time == b.time && a.kind == b.kind && a.lo == b.lo &&
         a.hi == b.hi;
}

inline void expect_same(const Statistics& a, const Statistics& b) {
  EXPECT_EQ(a.steps, b.steps);
  EXPECT_EQ(a.end_time, b.end_time);
  EXPECT_EQ(a.force_passes, b.force_passes);
  EXPECT_EQ(a.energy_initial, b.energy_initial);
  EXPECT_EQ(a.energy_final, b.energy_final);
  EXPECT_EQ(a.max_energy_error, b.max_energy_error);
  EXPECT_EQ(a.max_momentum_error, b.max_momentum_error);
  EXPECT_EQ(a.max_shadow_energy_error, b.max_shadow_energy_error);
  EXPECT_TRUE(a.mean_pressure == b.mean_pressure || (std::isnan(a.mean_pressure) && std::isnan(b.mean_pressure)));
  EXPECT_EQ(a.mean_free_path, b.mean_free_path);
  ASSERT_EQ(a.series.columns(), b.series.columns());
  for (std::size_t k = 0; k < a.series.columns(); ++k) {
    const Estimate one = a.series.estimate(k), other = b.series.estimate(k);
    for (const auto& [x, y] : {std::pair{one.mean, other.mean}, {one.error, other.error}, {one.samples, other.samples}})
      EXPECT_TRUE(x == y || (std::isnan(x) && std::isnan(y))) << "mean " << k << ": " << x << ", " << y;
  }
  const Counters &x = a.counters, &y = b.counters;
  EXPECT_EQ(x.sphere_sphere, y.sphere_sphere);
  EXPECT_EQ(x.sphere_wall, y.sphere_wall);
  EXPECT_EQ(x.max_overlap, y.max_overlap);
  ASSERT_EQ(a.overlap.has_value(), b.overlap.has_value());
  EXPECT_TRUE(!a.overlap || same(*a.overlap, *b.overlap));
  EXPECT_EQ(x.sweeps, y.sweeps);
  EXPECT_EQ(x.pieces, y.pieces);
  EXPECT_EQ(x.slabs_halved, y.slabs_halved);
  EXPECT_EQ(x.fallbacks, y.fallbacks);
  EXPECT_EQ(x.frozen, y.frozen);
  EXPECT_EQ(x.folded, y.folded);
}

}  // namespace carom::test
