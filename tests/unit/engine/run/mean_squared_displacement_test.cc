// SPDX-License-Identifier: BSD-3-Clause
#include "engine/run/mean_squared_displacement.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "engine/base/random.h"
#include "tests/support/experiments.h"

namespace carom::mean_squared_displacement_test {
namespace {

std::unique_ptr<System<2>> two_species(std::size_t n) {
  auto system = test::make_system<2>({5, 7}, Boundary::periodic, std::vector<Vec<2>>(n, Vec<2>(1, 1)),
                                     std::vector<Vec<2>>(n, Vec<2>::Zero()));
  system->species = {"a", "b"};
  for (std::size_t i = 0; i < n; ++i) system->particles.species[i] = i % 3 == 0;
  return system;
}

/// Compares with displacements between stored positions for equal origins: lag j·10^d intervals is measured from the
/// origins 0, 10^(d+1), 2·10^(d+1), …
TEST(MeanSquaredDisplacement, IsThatOfTheKeptPositions) {
  const std::size_t n = 7, samples = 2345;
  auto system = two_species(n);
  MeanSquaredDisplacement<2> msd(*system, {.interval = 0.5});
  std::vector<std::vector<Vec<2>>> kept;
  Particles<2> p = system->particles;
  for (std::uint32_t s = 0; s < samples; ++s) {
    RandomStream random(1, RandomPurpose::probe, s);
    std::vector<Vec<2>> unwrapped(n);
    for (std::size_t i = 0; i < n; ++i) {
      p.x[i] += Vec<2>(random.uniform() - 0.5 + 0.1 * static_cast<double>(i), random.uniform() - 0.5);
      system->box.wrap(p.x[i], p.image[i]);
      for (int k = 0; k < 2; ++k) unwrapped[i][k] = p.x[i][k] + p.image[i][k] * system->box.edges[k];
    }
    kept.push_back(unwrapped);
    msd.sample(0.5 * s, p);
  }
  EXPECT_EQ(msd.samples(), samples);
  const auto rows = msd.rows();
  std::size_t row = 0;
  for (std::size_t spacing = 1; spacing < samples; spacing *= 10)
    for (std::size_t j = 1; j < 10; ++j) {
      const std::size_t lag = j * spacing;
      double all = 0, ones = 0;
      std::size_t origins = 0;
      for (std::size_t from = 0; from + lag < samples; from += 10 * spacing, ++origins)
        for (std::size_t i = 0; i < n; ++i) {
          const double squared = (kept[from + lag][i] - kept[from][i]).squaredNorm();
          all += squared;
          if (i % 3 == 0) ones += squared;
        }
      if (origins == 0) continue;
      ASSERT_LT(row, rows.size());
      const auto o = static_cast<double>(origins);
      EXPECT_EQ(rows[row].origins, origins) << lag;
      EXPECT_DOUBLE_EQ(rows[row].time, 0.5 * static_cast<double>(lag));
      EXPECT_NEAR(rows[row].msd, all / (o * 7), 1e-12 * all) << lag;
      EXPECT_NEAR(rows[row].of.at(1), ones / (o * 3), 1e-12 * all) << lag;
      EXPECT_NEAR(rows[row].of.at(0), (all - ones) / (o * 4), 1e-12 * all) << lag;
      ++row;
    }
  EXPECT_EQ(row, rows.size());
  EXPECT_EQ(rows.back().time, 1000.0);
  const auto table = msd.table();
  ASSERT_EQ(table.size(), 11u);  // with an error and a number of samples for each mean
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const std::array expected{rows[k].time, static_cast<double>(rows[k].origins), rows[k].msd, rows[k].of[0],
                              rows[k].of[1]};
    for (std::size_t c = 0; c < 5; ++c) EXPECT_EQ(table[c].values.at(k), expected[c]) << table[c].name;
  }
  EXPECT_EQ(table[3].name, "msd_a");
  EXPECT_EQ(table[4].name, "msd_b");
}

TEST(MeanSquaredDisplacement, HasNoRowsBeforeTheSecondSample) {
  const auto system = two_species(3);
  MeanSquaredDisplacement<2> msd(*system, {.interval = 1});
  EXPECT_TRUE(msd.rows().empty());
  msd.sample(0, system->particles);
  EXPECT_TRUE(msd.rows().empty());
}

/// Free particles: v² t² at every lag, through the periodic boundaries, in a run.
TEST(MeanSquaredDisplacement, OfStraightFlights) {
  auto run = test::make_run<2>(test::make_system<2>({5, 7}, Boundary::periodic, {{1, 1}, {1, 4}}, {{3, 0}, {1, 0}}),
                               "free-flight", {.step = 1, .end_time = 40});
  MeanSquaredDisplacement<2> msd(run->system(), {.interval = 0.3, .start = 2});
  run->add(msd);
  run->run();
  EXPECT_EQ(msd.samples(), 127u);  // 2, 2.3, … 39.8
  const auto rows = msd.rows();
  ASSERT_EQ(rows.size(), 19u);  // 1 … 9, 10 … 90, 100 intervals
  for (const auto& row : rows) EXPECT_NEAR(row.msd, 5 * row.time * row.time, 1e-11 * row.msd);
}

}  // namespace
}  // namespace carom::mean_squared_displacement_test
