// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Sums of forces in fixed point: integers, so that the order of the terms does not matter.
//
// Each component of each force is rounded to a multiple of a quantum, a power of two that is constant in a run
// (quanta() in forces.h), so pair forces cancel exactly in the sum over all particles. A sum has a low word, and a high
// word for forces too large for the low one: its value is (2^40 high + low) quanta, however pairs used the two words.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "engine/base/exact_sum.h"
#include "engine/base/force_words.h"
#include "engine/base/vec.h"

namespace carom {

template <int D>
class ForceSums {
 public:
  __extension__ using Whole = __int128;

  ForceSums() = default;
  ForceSums(std::size_t particles, double quantum) { reset(particles, quantum); }

  /// Sets all sums to zero. `quantum`: a power of two [force].
  void reset(std::size_t particles, double quantum) {
    low_.assign(particles, {});
    high_.clear();
    quantum_ = quantum;
    used_low_ = used_high_ = 0;
    by_tilt_ = 0;
    invalid_ = false;
  }
  std::size_t size() const { return low_.size(); }
  double quantum() const { return quantum_; }

  /// Makes room for at most this many forces on any particle; returns how large each may be.
  ForceLimits make_room(std::size_t forces) {
    const double count = static_cast<double>(forces < 1 ? 1 : forces);
    const auto half = [&](double room) { return std::ldexp(1.0, std::ilogb(room / 2 / count)); };
    const ForceLimits limits{std::fmin(kMaxLowWord, half(kMaxWordSum)),
                             std::fmin(kMaxHighWord, half(kMaxWordSum - used_high_))};
    const double low = count * std::fmax(limits.low, 0x1p39);
    if (used_low_ + low > kMaxWordSum) carry();
    used_low_ += low;
    used_high_ += count * limits.high;
    return limits;
  }
  /// Whether more passes can be added: some hundred passes fill the sums, and invalid sums have no room.
  bool has_room() const { return !invalid_ && used_high_ < kMaxWordSum / 2; }

  /// The words themselves, to add to after make_room(). high() allocates the high words if there are none.
  ForceWords* low() { return low_.data(); }
  ForceWords* high() {
    if (high_.empty()) high_.resize(low_.size());
    return high_.data();
  }

  /// Adds a force on one particle, after make_room(). Returns false if the force is too large or NaN.
  bool add(Id i, const Vec<D>& force, const ForceLimits& limits) {
    for (int k = 0; k < D; ++k) {
      const double quanta = force[k] / quantum_;
      if (std::abs(quanta) < limits.low) {
        low_[i].of[k] += static_cast<std::int64_t>(std::nearbyint(quanta));
        continue;
      }
      const double upper = std::nearbyint(quanta * 0x1p-40);
      if (!(std::abs(upper) < limits.high)) return false;
      high()[i].of[k] += static_cast<std::int64_t>(upper);
      low_[i].of[k] += static_cast<std::int64_t>(std::nearbyint(quanta - upper * 0x1p40));
    }
    return true;
  }
  /// Whether there are high words.
  bool wide() const { return !high_.empty(); }
  /// Takes away the low or the high words of the sum on a particle, to be added to that of another rank.
  using Words = std::array<std::int64_t, D>;
  Words take(Id i, bool high) {
    Words taken;
    for (int k = 0; k < D; ++k) taken[k] = std::exchange((high ? this->high() : low())[i].of[k], 0);
    return taken;
  }
  /// Adds words that another rank has taken, taken[n] to the sum on the n-th of these particles.
  void add(std::span<const Id> particles, std::span<const Words> taken, bool high) {
    std::int64_t most = 0;
    for (const Words& words : taken)
      for (const std::int64_t word : words) most = std::max(most, std::abs(word));
    if (most == 0) return;
    double& used = high ? used_high_ : used_low_;
    if (!high && used + static_cast<double>(most) > kMaxWordSum) carry();
    if (high && used + static_cast<double>(most) > kMaxWordSum) return invalidate();
    used += static_cast<double>(most);
    ForceWords* const sums = high ? this->high() : low();
    for (std::size_t n = 0; n < taken.size(); ++n)
      for (int k = 0; k < D; ++k) sums[particles[n]].of[k] += taken[n][k];
  }
  /// Adds quanta of ∂V/∂tilt, and the sum so far of this rank's pairs; 0 in boxes that are not sheared. Of mean forces
  /// it is the discrete derivative.
  void add_by_tilt(Whole quanta) { by_tilt_ += quanta; }
  ExactSum by_tilt() const {
    ExactSum sum;
    sum.add(by_tilt_, quantum_);
    return sum;
  }
  /// Marks that some force could not be added: all values are NaN until reset().
  void invalidate() { invalid_ = true; }

  /// The force on a particle, rounded once.
  Vec<D> value(Id i) const {
    Vec<D> force;
    if (invalid_) return Vec<D>::Constant(std::numeric_limits<double>::quiet_NaN());
    for (int k = 0; k < D; ++k)
      force[k] = quantum_ * (high_.empty() ? static_cast<double>(low_[i].of[k])
                                           : static_cast<double>(whole(high_[i].of[k], low_[i].of[k])));
    return force;
  }
  /// The force on a particle in quanta.
  std::array<Whole, D> quanta(Id i) const {
    std::array<Whole, D> sum;
    for (int k = 0; k < D; ++k) sum[k] = whole(high_.empty() ? 0 : high_[i].of[k], low_[i].of[k]);
    return sum;
  }

 private:
  static Whole whole(std::int64_t high, std::int64_t low) { return (static_cast<Whole>(high) << kHighShift) + low; }

  /// Carries the low words into the high ones.
  void carry() {
    high();
    for (std::size_t i = 0; i < low_.size(); ++i)
      for (int k = 0; k < 4; ++k) {
        const std::int64_t upper = (low_[i].of[k] + (std::int64_t{1} << (kHighShift - 1))) >> kHighShift;
        high_[i].of[k] += upper;
        low_[i].of[k] -= upper << kHighShift;
      }
    used_low_ = 0x1p40;
    used_high_ += 0x1p24;
  }

  std::vector<ForceWords> low_, high_;  // high_ is empty until a force needs it
  double quantum_ = 1;
  Whole by_tilt_ = 0;
  bool invalid_ = false;
  double used_low_ = 0, used_high_ = 0;  // bounds of the sums [quanta]
};

}  // namespace carom
