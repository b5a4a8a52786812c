// SPDX-License-Identifier: BSD-3-Clause
#include "engine/run/transient.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace carom {

namespace {

/// Numbers that differ by less than this, relative to the largest, differ by rounding.
constexpr double kRounding = 1e-12;
/// The last batches are kept. With 4 × 5 batches or more, a drift drops three quarters, and the run goes on.
constexpr std::size_t kKept = 5;

/// The number d of White's rule.
std::size_t dropped_from(const std::vector<double>& x) {
  double largest = 0, mean = 0, squares = 0, least = std::numeric_limits<double>::infinity();
  for (const double each : x) largest = std::max(largest, std::abs(each));
  std::size_t found = 0;
  for (std::size_t d = x.size(); d-- > 0;) {  // adds batch d to the mean of the later ones
    const auto n = static_cast<double>(x.size() - d);
    const double above = x[d] - mean;
    mean += above / n;
    squares += above * (x[d] - mean);
    const double noise = kRounding * largest * kRounding * largest * n;
    const double z = std::max(squares, noise) / (n * n);
    if (n >= kKept && z <= least) {
      least = z;
      found = d;
    }
  }
  return found;
}

}  // namespace

std::optional<double> Transient::add(double time, const std::array<double, kSeries>& sample) {
  if (times_.empty() && in_batch_ == 0) start_ = time;
  for (std::size_t k = 0; k < kSeries; ++k) batch_[k] += sample[k];
  if (++in_batch_ < kBatch) return {};
  in_batch_ = 0;
  times_.push_back(time);
  for (std::size_t k = 0; k < kSeries; ++k) means_[k].push_back(std::exchange(batch_[k], 0) / kBatch);
  const std::size_t batches = times_.size();
  if (batches < next_) return {};
  next_ = batches + batches / 8 + 1;
  std::size_t dropped = 0;
  for (const auto& means : means_) dropped = std::max(dropped, dropped_from(means));
  if (2 * dropped > batches) return {};
  return dropped == 0 ? start_ : times_[dropped - 1];
}

}  // namespace carom
