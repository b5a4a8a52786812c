// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Mean accelerations of the next slab, extrapolated from past slabs. The sweeps of edda start from them.

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "engine/base/fields.h"
#include "engine/laws/interaction.h"

namespace carom::integrator {

template <int D>
class Extrapolation {
 public:
  static constexpr std::size_t kOrder = 2;  ///< from one slab more

  /// Starts from the accelerations at an instant; there are no past slabs yet.
  void start(Fields& fields, const std::vector<Vec<D>>& a) {
    for (std::size_t k = 0; k < past_.size(); ++k) {
      past_[k] = a;
      fields.add("past acceleration " + std::to_string(k), past_[k]);
    }
    known_ = 0;
    fields.add_value("past lengths", length_);
    fields.add_value("past slabs", known_);
  }
  /// Adds a completed slab of this length with these mean accelerations.
  void pass(double length, const std::vector<Vec<D>>& a) {
    std::rotate(length_.begin(), length_.end() - 1, length_.end());
    std::rotate(past_.begin(), past_.end() - 1, past_.end());
    length_[0] = length;
    past_[0] = a;
    known_ = std::min(known_ + 1, kOrder + 1);
  }
  /// Computes the mean accelerations of a slab of this length: Lagrange's polynomial through the integral of the
  /// acceleration at the ends of the past slabs, at times −s_k, of which it uses at most `most`.
  void expect(double length, Vectors<D> a, std::size_t most = kOrder + 1) {
    if (length > kMostGrowth * length_[0]) known_ = 0;
    const std::size_t known = std::min(known_, most);
    std::array<double, kOrder + 1> weight{1};
    std::array<double, kOrder + 2> s{};
    for (std::size_t k = 0; k < known; ++k) s[k + 1] = s[k] + length_[k];
    double sum = 0;
    for (std::size_t k = known; k > 0; --k) {
      double basis = 1;
      for (std::size_t l = 0; l <= known; ++l)
        if (l != k) basis *= (length + s[l]) / (s[l] - s[k]);
      sum += basis;
      weight[k - 1] = -sum * length_[k - 1] / length;
    }
    for (std::size_t i = 0; i < a.size(); ++i) {
      a[i] = weight[0] * past_[0][i];
      for (std::size_t k = 1; k < known; ++k) a[i] += weight[k] * past_[k][i];
    }
  }
  const std::vector<Vec<D>>& last() const { return past_[0]; }
  double last_length() const { return length_[0]; }  ///< 0: last() is of an instant

 private:
  /// Growth of the slab's length up to which all past slabs are used: the magnitudes of their weights, which multiply
  /// the noise of the past, add up to 18 there, and to 7 without growth.
  static constexpr double kMostGrowth = 3;

  std::array<std::vector<Vec<D>>, kOrder + 1> past_;
  std::array<double, kOrder + 1> length_{};
  std::size_t known_ = 0;  // number of successive slabs; 0: an acceleration at an instant
};

}  // namespace carom::integrator
