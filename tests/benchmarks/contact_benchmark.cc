// SPDX-License-Identifier: BSD-3-Clause
// The arithmetic of one candidate for a contact, and of one collision.

#include <benchmark/benchmark.h>

#include <vector>

#include "engine/base/random.h"
#include "engine/events/contact.h"
#include "engine/events/meeting.h"

namespace carom {
namespace {

constexpr double kDiameter = 1, kReach = 1.5;

/// Relative motion of two spheres.
template <int D>
struct Pair {
  Vec<D> d, v, a;
};

/// Pairs as a prediction finds them in a fluid: distances between contact and `reach` diameters, thermal velocities;
/// half of them approach, some of these collide.
template <int D>
std::vector<Pair<D>> pairs(double reach) {
  constexpr std::size_t kPairs = 4096;  // fits the cache, but not the branch predictor
  std::vector<Pair<D>> all(kPairs);
  for (std::size_t i = 0; i < kPairs; ++i) {
    RandomStream place(1, RandomPurpose::position, static_cast<std::uint32_t>(i));
    RandomStream velocity(1, RandomPurpose::velocity, static_cast<std::uint32_t>(i));
    do
      for (int k = 0; k < D; ++k) all[i].d[k] = reach * (2 * place.uniform() - 1);
    while (all[i].d.norm() <= kDiameter || all[i].d.norm() > reach);
    for (int k = 0; k < D; ++k) {
      all[i].v[k] = velocity.normal_pair()[0] - velocity.normal_pair()[0];
      all[i].a[k] = velocity.normal_pair()[0];
    }
  }
  return all;
}

template <int D>
void straight_contact(benchmark::State& state) {
  const auto all = pairs<D>(kReach);
  for (auto _ : state)
    for (const auto& p : all) benchmark::DoNotOptimize(contact_time<D>(p.d, p.v, kDiameter, 0.0));
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(all.size()));
}
BENCHMARK(straight_contact<2>);
BENCHMARK(straight_contact<3>);

template <int D>
void parabolic_contact(benchmark::State& state) {
  const auto all = pairs<D>(kReach);
  constexpr double kRest = 0.1;
  for (auto _ : state)
    for (const auto& p : all) benchmark::DoNotOptimize(contact_time<D>(p.d, p.v, p.a, kDiameter, kRest, false, 0.0));
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(all.size()));
}
BENCHMARK(parabolic_contact<2>);
BENCHMARK(parabolic_contact<3>);

template <int D>
void collision(benchmark::State& state) {
  const auto all = pairs<D>(kReach);
  for (auto _ : state)
    for (const auto& p : all) {
      const Vec<D> impulse = collision_factor<D>(p.d, p.v, 1.0, 1.0) * p.d;
      benchmark::DoNotOptimize(impulse);
    }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(all.size()));
}
BENCHMARK(collision<2>);
BENCHMARK(collision<3>);

}  // namespace
}  // namespace carom
