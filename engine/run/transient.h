// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Finds the end of the initial transient of a run, while it goes on.
//
// MSER-5, the marginal standard error rule (White, Simulation 69 (1997) 323): series are averaged over batches of five
// samples, and of the n batches the first d are dropped for which the marginal standard error of the rest,
//
//   z(d) = Σ_{i>d} (x_i − mean)²/(n − d)²,
//
// is the smallest. This is no more than a guess if d is in the second half: then the run goes on. The rule is applied
// from the twentieth batch on, whenever there is an eighth more; the last five batches are never dropped, because so
// few have a small z by chance. Of several series the one with the longest transient counts.

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "engine/base/archive.h"

namespace carom {

class Transient {
 public:
  static constexpr std::size_t kSeries = 2;

  /// Adds a sample of each series, at a time after the last one. Returns the time at which the transient ended once it
  /// is known: the end of the last batch that was dropped, or the first sample.
  std::optional<double> add(double time, const std::array<double, kSeries>& sample);

  void archive(Archive& archive) { archive(start_, times_, means_, batch_, in_batch_, next_); }

 private:
  static constexpr std::uint64_t kBatch = 5, kFewest = 20;

  double start_ = 0;                                // time of the first sample
  std::vector<double> times_;                       // ends of batches
  std::array<std::vector<double>, kSeries> means_;  // of batches
  std::array<double, kSeries> batch_{};             // sums in the batch that is not full
  std::uint64_t in_batch_ = 0, next_ = kFewest;     // samples in it; batches at which the rule is applied next
};

}  // namespace carom
