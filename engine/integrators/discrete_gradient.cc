// SPDX-License-Identifier: BSD-3-Clause
#include "engine/integrators/discrete_gradient.h"

#include <algorithm>
#include <cmath>

namespace carom::integrator {

namespace {
/// A piece in which the iteration contracts by less is halved: half the length contracts by a quarter of it.
constexpr double kWorstContraction = 0.5;
/// At that contraction 53 iterations take any difference to rounding; a few more to see that it has become as small.
constexpr int kMostIterations = 60;
}  // namespace

template <int D>
DiscreteGradient<D>::DiscreteGradient(System<D>& system, int order) : system_(system) {
  if (order == 4) {
    constexpr double gamma = 0.41449077179437573714;  // 1/(4 − 4^{1/3})
    fractions_ = {gamma, gamma, 1 - 4 * gamma, gamma, gamma};
  } else {
    fractions_ = {1.0};
  }
  const std::size_t n = system.particles.size();
  mean_acceleration_.assign(fractions_.size(), std::vector<Vec<D>>(n, Vec<D>::Zero()));
  for (std::size_t stage = 0; stage < mean_acceleration_.size(); ++stage)
    system.fields.add("mean acceleration " + std::to_string(stage), mean_acceleration_[stage]);
  for (auto* field : {&x_, &v_, &chord_, &trial_, &force_, &mean_, &next_}) field->assign(n, Vec<D>::Zero());
}

template <int D>
bool DiscreteGradient<D>::solve(Positions<D> x, Positions<D> v, double tau, ContactScan<D>& scan, Counters& counters) {
  std::ranges::copy(x, x_.begin());
  std::ranges::copy(v, v_.begin());
  for (std::size_t stage = 0; stage < fractions_.size(); ++stage)
    if (!substep(fractions_[stage] * tau, stage, scan, counters)) return false;
  if (fractions_.size() == 1)
    std::ranges::copy(mean_, chord_.begin());
  else
    for (std::size_t i = 0; i < x_.size(); ++i) chord_[i] = (x_[i] - x[i]) / tau;
  return true;
}

template <int D>
bool DiscreteGradient<D>::substep(double tau, std::size_t stage, ContactScan<D>& scan, Counters& counters) {
  const std::size_t n = x_.size();
  const auto& mass = system_.particles.mass;
  auto& a = mean_acceleration_[stage];
  const auto& box = system_.box;
  const bool resting = !scan.resting().empty();
  auto give_up = [&] {
    for (auto& stage_guess : mean_acceleration_) std::ranges::fill(stage_guess, Vec<D>::Zero());
    return false;
  };
  for (std::size_t i = 0; i < n; ++i) mean_[i] = v_[i] + (0.5 * tau) * a[i];
  double last = std::numeric_limits<double>::infinity();
  for (int iteration = 0; iteration < kMostIterations; ++iteration) {
    for (std::size_t i = 0; i < n; ++i) {
      trial_[i] = x_[i] + tau * mean_[i];
      for (int k = 0; k < D; ++k)  // an iterate far away would meet too many images
        if (box.periodic(k) && !(std::abs(tau * mean_[i][k]) <= 0.5 * box.edges[k])) return give_up();
    }
    evaluate_mean_forces<D>(system_, x_, trial_, force_, counters);
    ++counters.sweeps;
    for (std::size_t i = 0; i < n; ++i) {
      a[i] = force_[i] / mass[i];
      next_[i] = v_[i] + (0.5 * tau) * a[i];
    }
    if (resting && !scan.hold_means(x_, mean_, next_, tau)) return give_up();
    double change = 0, speed = 0;
    for (std::size_t i = 0; i < n; ++i) {
      change = std::max(change, (next_[i] - mean_[i]).squaredNorm());
      speed = std::max({speed, next_[i].squaredNorm(), v_[i].squaredNorm()});
    }
    // Velocities of spheres at rest are differences of the kicks by reactions and by forces, and their rounding is that
    // of the kicks.
    for (const auto& contact : scan.resting()) {
      const double lightest = contact.key.kind == EventKind::pair ? std::min(mass[contact.key.lo], mass[contact.key.hi])
                                                                  : mass[contact.key.lo];
      const double kick = 0.5 * tau * contact.force / lightest;
      speed = std::max(speed, kick * kick);
    }
    change = std::sqrt(change);
    // Smaller increments are rounding errors, and their ratios are meaningless.
    const double floor = 16 * std::numeric_limits<double>::epsilon() * std::sqrt(speed);
    std::swap(mean_, next_);
    if (!std::isfinite(change)) break;
    if (change == 0 || (change >= last && change <= floor)) {
      for (std::size_t i = 0; i < n; ++i) {
        x_[i] += tau * mean_[i];
        v_[i] = resting ? Vec<D>(2 * mean_[i] - v_[i]) : Vec<D>(v_[i] + tau * a[i]);
      }
      return true;
    }
    if (iteration > 2 && change > floor && change > kWorstContraction * last) break;
    last = change;
  }
  return give_up();
}

template class DiscreteGradient<2>;
template class DiscreteGradient<3>;

}  // namespace carom::integrator
