#pragma once
// What the mean accelerations of past pieces let expect of the next: where the sweeps of edda start.

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "engine/exchange.h"
#include "engine/interaction.h"

namespace carom::integrator {

/// Mean accelerations of past pieces, and what they let expect of the next.
template <int D>
class Extrapolation {
 public:
  void start(const std::vector<Vec<D>>& a) {
    for (auto& past : past_) past = a;
    age_.assign(a.size(), 0);
    time_.assign(a.size(), 0.0);
    length_.fill(0);
  }
  /// Frees what is known of particles; resize() follows.
  void release() {
    for (auto& past : past_) past = std::vector<Vec<D>>();
    age_ = std::vector<std::uint8_t>();
    time_ = std::vector<double>();
  }
  void resize(std::size_t particles) {
    for (auto& past : past_) past.resize(particles);
    age_.resize(particles);
    time_.resize(particles);
  }
  /// What is known of a particle.
  void pack(Id i, Bytes& to) const {
    Known known{{}, time_[i], age_[i]};
    for (std::size_t k = 0; k < past_.size(); ++k) known.past[k] = past_[k][i];
    put(to, known);
  }
  void unpack(Id i, Reader& from) {
    const auto known = from.get<Known>();
    for (std::size_t k = 0; k < past_.size(); ++k) past_[k][i] = known.past[k];
    age_[i] = known.age;
    time_[i] = known.time;
  }
  /// A piece of this length is done; then add() for everybody.
  void pass(double length) {
    std::ranges::rotate(length_, length_.end() - 1);
    std::ranges::rotate(past_, past_.end() - 1);
    length_[0] = length;
  }
  /// The mean acceleration over the last part of a piece, a time long; the whole piece where it was smooth.
  void add(Id i, const Vec<D>& a, double time) {
    past_[0][i] = a;
    age_[i] = time < length_[0] ? 1 : std::min<std::uint8_t>(age_[i] + 1, kOrder + 1);
    time_[i] = time;
  }
  /// The mean accelerations of a piece of this length: of the polynomial that had the means known.
  void expect(double length, Vectors<D> a) {
    if (length > kMostGrowth * length_[0])
      for (auto& age : age_) age = std::min<std::uint8_t>(age, 1);
    const auto weight = weights(length);
    for (std::size_t i = 0; i < a.size(); ++i) {
      a[i] = weight[age_[i]][0] * past_[0][i];
      for (std::size_t k = 1; k < age_[i]; ++k) a[i] += weight[age_[i]][k] * past_[k][i];
    }
  }
  /// The last ones, and over which times.
  const std::vector<Vec<D>>& last() const { return past_[0]; }
  const std::vector<double>& time() const { return time_; }

 private:
  static constexpr std::size_t kOrder = 3;
  struct Known {
    std::array<Vec<D>, kOrder + 1> past;
    double time;
    std::uint8_t age;
  };
  static constexpr double kMostGrowth = 3;  // of pieces; beyond it only the last one counts

  /// [age][piece]. The integral of the acceleration is known at the pieces' ends, −s_k before now, and continued by
  /// Lagrange's polynomial.
  std::array<std::array<double, kOrder + 1>, kOrder + 2> weights(double length) const {
    std::array<std::array<double, kOrder + 1>, kOrder + 2> weight{};
    weight[0][0] = 1;
    std::array<double, kOrder + 2> s{};
    for (std::size_t k = 0; k <= kOrder; ++k) s[k + 1] = s[k] + length_[k];
    for (std::size_t age = 1; age <= kOrder + 1 && length_[age - 1] > 0; ++age) {
      double sum = 0;
      for (std::size_t k = age; k > 0; --k) {
        double basis = 1;
        for (std::size_t l = 0; l <= age; ++l)
          if (l != k) basis *= (length + s[l]) / (s[l] - s[k]);
        sum += basis;
        weight[age][k - 1] = -sum * length_[k - 1] / length;
      }
    }
    return weight;
  }

  std::array<std::vector<Vec<D>>, kOrder + 1> past_;
  std::array<double, kOrder + 1> length_{};
  std::vector<std::uint8_t> age_;  // how many of them belong together; 0: an acceleration at an instant
  std::vector<double> time_;
};

}  // namespace carom::integrator
