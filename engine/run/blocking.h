// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Means of correlated series with their standard errors, computed while a run goes on.
//
//   Blocking series(2);
//   for (…) series.add({{energy, pressure}});          // or with weights: {{Σ K, impulse}}, {{particles, duration}}
//   const Estimate e = series.estimate(0);             // e.mean ± e.error
//
// Each column is a series of values v with weights w; its mean is Σv/Σw. Consecutive samples are summed in blocks; when
// there are 128 blocks, neighbours are merged, so that a sample costs a few additions a column however long the run is.
// With residuals r = v − w Σv/Σw, the standard error is √(n s²)/Σw, where s² is the variance of r of n blocks, once the
// blocks are so long that their r are independent (Flyvbjerg, Petersen, J. Chem. Phys. 91 (1989) 461). Whether they are
// is tested as Jonsson does (Phys. Rev. E 98 (2018) 043304): among partitions into blocks, each twice as long as in the
// partition before, the first is found from which on the correlations of neighbouring blocks are, taken together, not
// larger than those of independent blocks in 95 of 100 cases. Since the test misses weak correlations in short series,
// the error is taken from the next partition, whose bias is half as large, if it has eight blocks.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "engine/base/archive.h"

namespace carom {

struct Estimate {
  double mean = std::numeric_limits<double>::quiet_NaN();
  /// One standard error; NaN if there are fewer than eight independent blocks. It is itself uncertain by 9 % (64
  /// blocks) to 27 % (eight).
  double error = std::numeric_limits<double>::quiet_NaN();
  /// The number of independent samples that would have this standard error: the variance of the samples over error².
  double samples = std::numeric_limits<double>::quiet_NaN();
  /// Where there is no error: the fewest samples with which there may be one, at the correlations seen so far.
  double needed = 0;
};

class Blocking {
 public:
  Blocking() : Blocking(0) {}
  explicit Blocking(std::size_t columns);

  /// Adds a sample: a value for each column, and one weight for all or one for each; the same choice for all samples.
  void add(std::span<const double> values, std::span<const double> weights);
  void add(std::span<const double> values) {
    constexpr double one = 1;
    add(values, {&one, 1});
  }
  std::uint64_t samples() const { return samples_; }
  std::size_t columns() const { return columns_; }
  Estimate estimate(std::size_t column) const;
  /// A function of the sums Σv of all columns over so many samples.
  using Function = std::function<double(std::span<const double> sums, double samples)>;
  /// The standard error of a function by the jackknife: 8 to 16 parts of the series are left out, one after the other
  /// (Efron, Stein, Ann. Stat. 9 (1981) 586). NaN if there are fewer than eight blocks.
  double error_of(const Function& function) const;

  void archive(Archive& archive) {
    archive(columns_, weights_, most_, samples_, length_, values_, weight_, first_, squares_);
  }

 private:
  void merge();

  std::uint64_t columns_, weights_ = 0;  // columns, and weights of a sample
  std::uint64_t most_;                   // blocks
  std::uint64_t samples_ = 0;
  std::uint64_t length_ = 1;             // samples in a block
  std::vector<double> values_, weight_;  // sums [block][column]; of values less first_ × weight
  std::vector<double> first_;            // v/w of the first sample of each column, or 0: keeps digits
  std::vector<double> squares_;          // by column: Σv², Σvw, Σw² of the samples, v less first_ × w
};

}  // namespace carom
