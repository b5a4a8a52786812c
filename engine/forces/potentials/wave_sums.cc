// SPDX-License-Identifier: BSD-3-Clause
#include "engine/forces/potentials/wave_sums.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace carom {
namespace {

using Vec3 = Vec<3>;

// Charges that share a part of the waves in the first level of cache: the phases of each take one or two KB.
constexpr std::size_t kTogether = 16;

/// A power of two above |value| has this exponent.
int exponent_of(double value) { return std::ilogb(std::max(value, 0x1p-900)) + 1; }

/// WaveKernels::pull_moved() where |k·y| may exceed 1.
void pull_far(const WaveTask& task, const Vec3& y, const Amplitudes& field, double* sum) {
  for (std::size_t r = 0; r < task.n; ++r)
    for (unsigned m = 0; m < 2 * task.rows[r].count; ++m) {
      const WaveRow& row = task.rows[r];
      const int c = static_cast<int>(m % row.count), sign = m < row.count ? 1 : -1;
      const Vec3 index(row.a, row.b, sign * c);
      double re = 1, im = 0;
      for (int k = 0; k < 3; ++k) {
        const int n = k == 0 ? row.a : k == 1 ? row.b : c;
        const double last = re, turned = k == 2 ? sign * task.im[k][n] : task.im[k][n];
        re = last * task.re[k][n] - im * turned;
        im = last * turned + im * task.re[k][n];
      }
      const std::array<double, 2> wave = wave_of(field, row.first + m % row.count, sign);
      const Vec3 pull = (0.5 * (wave[0] * im - wave[1] * re) * sinc(index.dot(y))) * index;
      for (int k = 0; k < 3; ++k) sum[k] += pull[k];
    }
}

}  // namespace

WaveSums::WaveSums(std::shared_ptr<const Waves> waves, const Particles<3>& particles, const std::vector<double>& charge,
                   double largest, std::size_t total)
    : waves_(std::move(waves)), particles_(particles), charge_(charge), largest_(largest), total_(total) {
  for (std::size_t i = 0; i < 3 * kTogether; ++i) phases_.emplace_back(waves_->most[i % 3]);
}

const std::vector<Id>& WaveSums::charged() const {
  if (charged_.empty())
    for (Id i = 0; i < particles_.size(); ++i)
      if (charge_[i] != 0 && particles_.owns(i)) charged_.push_back(i);
  return charged_;
}

/// The largest norm of a vector of a charge on any rank.
double WaveSums::longest(Positions vectors) const {
  double most = 0;
  for (const Id j : charged()) most = std::max(most, vectors[j].norm());
  ranks_->largest({&most, 1});
  return most;
}

/// Calls visit(j, waves at x_j) for each own charge and each part of the waves: a part serves several charges while it
/// is in the cache.
void WaveSums::for_each_part(Positions x, auto&& visit) const {
  const std::span<const Id> all = charged();
  turns_.resize(particles_.size(), {Vec3::Constant(std::numeric_limits<double>::quiet_NaN()), {}});
  for (std::size_t first = 0; first < all.size(); first += kTogether) {
    const std::span<const Id> some = all.subspan(first, std::min(kTogether, all.size() - first));
    for (std::size_t i = 0; i < some.size(); ++i) {
      Turns& last = turns_[some[i]];
      for (int k = 0; k < 3; ++k) {
        const double at = x[some[i]][k];
        if (at != last.x[k]) last.of[k] = turn((last.x[k] = at) / waves_->edges[k]);
        phases_[3 * i + k].set(last.of[k]);
      }
    }
    for (const Waves::Part& part : waves_->parts)
      for (std::size_t i = 0; i < some.size(); ++i) {
        const Phases* const p = &phases_[3 * i];
        visit(some[i], WaveTask{&waves_->rows[part.first],
                                part.n,
                                {p[0].re(), p[1].re(), p[2].re()},
                                {p[0].im(), p[1].im(), p[2].im()}});
      }
  }
}

/// Sums over all charges in fixed point: add(j, waves, shift, sums) adds a term and the shift to each sum,
/// |term| ≤ 2^exponent. Terms are rounded to the quantum by adding a constant; the integers are then the mantissas'
/// differences.
Amplitudes WaveSums::sum(Positions x, int exponent, auto&& add) const {
  const double n = static_cast<double>(total_);
  const double quantum = std::ldexp(std::max(0x1p-50, std::ldexp(1.0, std::ilogb(n) - 60)), exponent);
  const double shift = 0x1.8p52 * quantum;
  std::vector<std::uint64_t> whole(WaveRow::kProducts * waves_->size());
  for_each_part(x, [&](Id j, const WaveTask& task) { add(j, task, shift, whole.data()); });
  const std::uint64_t shifts = charged().size() * std::bit_cast<std::uint64_t>(shift);
  for (std::uint64_t& each : whole) each -= shifts;
  ranks_->sum(whole);
  Amplitudes sum(whole.size());
  for (std::size_t k = 0; k < sum.size(); ++k)
    sum[k] = quantum * static_cast<double>(static_cast<std::int64_t>(whole[k]));
  return sum;
}

Amplitudes WaveSums::structure(Positions x) const {
  return sum(x, exponent_of(largest_), [&](Id j, const WaveTask& task, double shift, std::uint64_t* sums) {
    kernels_->add(task, charge_[j], shift, sums);
  });
}

Amplitudes WaveSums::structure_change(Positions x, Positions w) const {
  const int exponent = exponent_of(largest_ * longest(w) * waves_->longest) + 1;
  return sum(x, exponent, [&](Id j, const WaveTask& task, double shift, std::uint64_t* sums) {
    const Vec3 along = w[j].cwiseProduct(waves_->unit);
    kernels_->add_change(task, charge_[j], along.data(), shift, sums);
  });
}

std::array<Amplitudes, 3> WaveSums::current(Positions x, Positions v) const {
  const int exponent = exponent_of(largest_ * longest(v));
  std::array<Amplitudes, 3> sums;
  for (int a = 0; a < 3; ++a)
    sums[a] = sum(x, exponent, [&](Id j, const WaveTask& task, double shift, std::uint64_t* to) {
      kernels_->add(task, charge_[j] * v[j][a], shift, to);
    });
  return sums;
}

Amplitudes WaveSums::potential(const Amplitudes& s) const {
  Amplitudes field(s.size());
  for (std::size_t k = 0; k < waves_->size(); ++k)
    for (unsigned product = 0; product < WaveRow::kProducts; ++product)
      field[place_of(k, product)] = 2 * waves_->weight[k] * s[place_of(k, product)];
  return field;
}

/// Adds up vectors in units of 2π/L, which add(j, waves, vector) adds to, times the charges.
std::vector<Vec3> WaveSums::per_charge(Positions x, auto&& add) const {
  std::vector<Vec3> f(x.size(), Vec3::Zero());
  for_each_part(x, [&](Id j, const WaveTask& task) { add(j, task, f[j].data()); });
  for (const Id j : charged()) f[j] = charge_[j] * f[j].cwiseProduct(waves_->unit);
  return f;
}

std::vector<Vec3> WaveSums::pull(Positions x, const Amplitudes& field) const {
  return per_charge(x, [&](Id, const WaveTask& task, double* sum) { kernels_->pull(task, field.data(), sum); });
}

std::vector<Vec3> WaveSums::pull_change(Positions x, const Amplitudes& field, Positions w) const {
  return per_charge(x, [&](Id j, const WaveTask& task, double* sum) {
    const Vec3 along = w[j].cwiseProduct(waves_->unit);
    kernels_->pull_change(task, along.data(), field.data(), sum);
  });
}

std::vector<Vec3> WaveSums::pull_moved(Positions x, const Amplitudes& field, Positions half) const {
  return per_charge(x, [&](Id j, const WaveTask& task, double* sum) {
    const Vec3 y = half[j].cwiseProduct(waves_->unit);
    const double most = waves_->longest * half[j].norm();
    if (most < 1 - 1e-9)
      kernels_->pull_moved(task, y.data(), most, field.data(), sum);
    else
      pull_far(task, y, field, sum);
  });
}

}  // namespace carom
