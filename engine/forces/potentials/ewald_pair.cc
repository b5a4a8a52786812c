// SPDX-License-Identifier: BSD-3-Clause
#include "engine/forces/potentials/ewald_pair.h"

#include <numbers>
#include <vector>

namespace carom {

EwaldPair::EwaldPair(double constant, double alpha, double end, double error)
    : c_(constant), alpha_(alpha), end2_(end * end), slope_(2 / end2_) {
  const double h = 0.5 * alpha * alpha * end2_;
  const auto terms = static_cast<std::size_t>(64 + 4 * h);  // beyond, all are below 2^-60
  std::vector<double> j(4 * terms, 0.0);
  for (std::size_t n = j.size() - 1; n-- > 0;)
    j[n] =
        (2 * h * j[n + 1] + (2 * std::numbers::inv_sqrtpi) * elementary::exp(-h)) / (2.0 * static_cast<double>(n) + 1);
  std::vector<double> chebyshev(terms);
  double first = 2, taylor = 1;
  for (std::size_t n = 0; n < terms; ++n) {
    double term = first;
    for (std::size_t m = 0; m < terms; ++m) {
      chebyshev[n] += term * j[2 * m + n];
      const auto next = static_cast<double>(m + 1);
      term *= 0.25 * h * h / (next * (next + static_cast<double>(n)));
    }
    if (n < kMostTerms) term_[n] = taylor * j[n];
    const auto next = static_cast<double>(n + 1);
    first *= -0.5 * h / next;
    taylor *= -h / next;
  }
  // |dT_n/dt| ≤ n², dt/du = 1/h
  double left_out = 0;
  for (degree_ = terms - 1; degree_ > 1; --degree_) {
    const auto n = static_cast<double>(degree_);
    left_out += std::abs(chebyshev[degree_]) * n * n / h;
    if (left_out > error && degree_ < kMostTerms) break;
  }
  std::vector<double> before(terms + 1), last(terms + 1), next(terms + 1);  // coefficients of T_{n−1}, T_n, T_{n+1}
  before[0] = last[1] = 1;
  for (std::size_t n = 1; n < terms; ++n) {
    for (std::size_t k = 0; n > degree_ && k <= degree_; ++k) term_[k] -= chebyshev[n] * last[k];
    for (std::size_t k = 0; k <= terms; ++k) next[k] = (k > 0 ? 2 * last[k - 1] : 0) - before[k];
    before.swap(last);
    last.swap(next);
  }
  for (std::size_t n = 0; n <= degree_; ++n) {
    term_[n] *= constant * alpha;
    const auto k = static_cast<double>(n);
    if (n > 0) first_[n - 1] = slope_ * k * term_[n];
    if (n > 1) second_[n - 2] = slope_ * (k - 1) * first_[n - 1];
  }
  for (std::size_t n = degree_ + 1; n < kMostTerms; ++n) term_[n] = 0;
}

}  // namespace carom
