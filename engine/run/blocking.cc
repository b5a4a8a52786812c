// SPDX-License-Identifier: BSD-3-Clause
#include "engine/run/blocking.h"

#include <algorithm>
#include <cmath>

namespace carom {

namespace {

/// With 64 to 128 blocks, half of which are used if the samples are independent, an error is known to 9 to 13 %.
constexpr std::uint64_t kMostBlocks = 128;
/// Tables with many columns have fewer blocks: a megabyte of sums, but at least 32 blocks.
constexpr std::uint64_t kMostNumbers = 1 << 17, kFewestMostBlocks = 32;
/// Fewer blocks have no standard error, which would be uncertain by more than 27 %.
constexpr std::size_t kFewestBlocks = 8;
/// The parts of the jackknife, whose error is uncertain by 18 %.
constexpr std::size_t kMostParts = 16;
/// Partitions with fewer blocks say nothing about correlations.
constexpr std::size_t kFewestTested = 4;

/// The value that chi square with k degrees of freedom exceeds with a probability of 5 %, within 1 % (Wilson, Hilferty,
/// Proc. Natl. Acad. Sci. 17 (1931) 684); a normal deviate exceeds 1.645 with this probability.
double largest_by_chance(std::size_t k) {
  const double part = 2 / (9 * static_cast<double>(k)), root = 1 - part + 1.645 * std::sqrt(part);
  return static_cast<double>(k) * root * root * root;
}

struct Partition {
  double variance = 0;  // of the residuals of its blocks
  double chance = 0;    // M of Jonsson's (43): a chi square with one degree of freedom where blocks are independent
};

Partition analyse(const std::vector<double>& residuals) {
  const auto n = static_cast<double>(residuals.size());
  double mean = 0, squares = 0, products = 0, before = 0;
  for (const double r : residuals) mean += r;
  mean /= n;
  for (const double r : residuals) {
    squares += (r - mean) * (r - mean);
    products += before * (r - mean);
    before = r - mean;
  }
  if (!(squares > 0)) return {squares, 0};                            // all equal, or not numbers
  const double correlation = products / squares + (n - 1) / (n * n);  // the mean of the first term is −(n − 1)/n²
  return {squares / (n - 1), n * correlation * correlation};
}

}  // namespace

Blocking::Blocking(std::size_t columns)
    : columns_(columns),
      most_(std::clamp(kMostNumbers / std::max<std::uint64_t>(columns, 1), kFewestMostBlocks, kMostBlocks) & ~1U),
      first_(columns),
      squares_(3 * columns) {}

void Blocking::add(std::span<const double> values, std::span<const double> weights) {
  if (samples_ == 0) weights_ = weights.size();
  if (samples_ == most_ * length_) merge();
  if (samples_ % length_ == 0) {  // a block begins
    values_.resize(values_.size() + columns_);
    weight_.resize(weight_.size() + weights_);
  }
  double* const value = values_.data() + (values_.size() - columns_);
  double* const weight = weight_.data() + (weight_.size() - weights_);
  for (std::size_t k = 0; k < weights_; ++k) weight[k] += weights[k];
  for (std::size_t k = 0; k < columns_; ++k) {
    const double w = weights[weights_ == 1 ? 0 : k];
    if (samples_ == 0 && w != 0) first_[k] = values[k] / w;
    const double v = values[k] - first_[k] * w;
    value[k] += v;
    squares_[3 * k] += v * v;
    squares_[3 * k + 1] += v * w;
    squares_[3 * k + 2] += w * w;
  }
  ++samples_;
}

/// Merges neighbouring blocks; their number is even.
void Blocking::merge() {
  const auto halve = [](std::vector<double>& sums, std::size_t width) {
    const std::size_t blocks = sums.size() / width / 2;
    for (std::size_t block = 0; block < blocks; ++block)
      for (std::size_t k = 0; k < width; ++k)
        sums[block * width + k] = sums[2 * block * width + k] + sums[(2 * block + 1) * width + k];
    sums.resize(blocks * width);
  };
  halve(values_, columns_);
  halve(weight_, weights_);
  length_ *= 2;
}

Estimate Blocking::estimate(std::size_t column) const {
  Estimate found;
  found.needed = static_cast<double>(kFewestBlocks);
  if (samples_ == 0) return found;
  const std::size_t blocks = weight_.size() / weights_, whole = samples_ / length_;
  const auto value = [&](std::size_t block) { return values_[block * columns_ + column]; };
  const auto weight = [&](std::size_t block) { return weight_[block * weights_ + (weights_ == 1 ? 0 : column)]; };
  double sum = 0, weights = 0;
  for (std::size_t block = 0; block < blocks; ++block) {
    sum += value(block);
    weights += weight(block);
  }
  if (weights == 0) return found;
  const double above = sum / weights;  // the mean less first_
  found.mean = first_[column] + above;

  std::vector<double> residuals(whole);
  for (std::size_t block = 0; block < whole; ++block) residuals[block] = value(block) - above * weight(block);
  std::vector<Partition> partitions;
  while (residuals.size() >= kFewestTested) {
    partitions.push_back(analyse(residuals));
    for (std::size_t block = 0; 2 * block + 1 < residuals.size(); ++block)
      residuals[block] = residuals[2 * block] + residuals[2 * block + 1];
    residuals.resize(residuals.size() / 2);
  }
  double correlation = 0;
  std::size_t chosen = partitions.size();
  for (std::size_t k = partitions.size(); k-- > 0;) {
    correlation += partitions[k].chance;
    if (correlation <= largest_by_chance(partitions.size() - k)) chosen = k;
  }
  const auto in_block = [&](std::size_t k) { return static_cast<double>(length_ << k); };  // samples
  // If even the longest blocks are correlated, independent ones are longer.
  found.needed = std::max(found.needed, static_cast<double>(kFewestBlocks) * in_block(chosen));
  if (chosen == partitions.size() || whole >> chosen < kFewestBlocks) return found;
  found.needed = 0;
  if (whole >> (chosen + 1) >= kFewestBlocks) ++chosen;
  const double length = in_block(chosen);
  const double number = static_cast<double>(samples_) / length;
  found.error = std::sqrt(number * partitions[chosen].variance) / std::abs(weights);
  const double* const s = &squares_[3 * column];
  const double of_all = std::max(s[0] - above * (2 * s[1] - above * s[2]), 0.0);
  const double per_sample = found.error * found.error * weights * weights / static_cast<double>(samples_);
  if (found.error > 0) found.samples = of_all / per_sample;
  return found;
}

double Blocking::error_of(const Function& function) const {
  const std::size_t whole = samples_ / length_, parts = std::min<std::size_t>(whole, kMostParts);
  if (parts < kFewestBlocks) return std::numeric_limits<double>::quiet_NaN();
  const std::size_t size = whole / parts;  // blocks in a part
  std::vector<double> all(columns_), rest(columns_), without(parts);
  const auto add = [&](std::size_t block, double sign, std::vector<double>& sums) {
    for (std::size_t k = 0; k < columns_; ++k)
      sums[k] +=
          sign * (values_[block * columns_ + k] + first_[k] * weight_[block * weights_ + (weights_ == 1 ? 0 : k)]);
  };
  for (std::size_t block = 0; block < parts * size; ++block) add(block, 1, all);
  double mean = 0, squares = 0;
  for (std::size_t part = 0; part < parts; ++part) {
    rest = all;
    for (std::size_t block = part * size; block < (part + 1) * size; ++block) add(block, -1, rest);
    without[part] = function(rest, static_cast<double>((parts - 1) * size * length_));
    mean += without[part] / static_cast<double>(parts);
  }
  for (const double each : without) squares += (each - mean) * (each - mean);
  const auto n = static_cast<double>(parts);
  return std::sqrt((n - 1) / n * squares);
}

}  // namespace carom
