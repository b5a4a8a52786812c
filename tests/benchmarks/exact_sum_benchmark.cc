// SPDX-License-Identifier: BSD-3-Clause
// Sums that do not depend on the order: a term, and a rounding.

#include <benchmark/benchmark.h>

#include <vector>

#include "engine/base/exact_sum.h"
#include "engine/base/random.h"

namespace carom {
namespace {

std::vector<double> normal_terms() {
  std::vector<double> terms(4096);
  for (std::size_t i = 0; i < terms.size(); ++i)
    terms[i] = RandomStream(1, RandomPurpose::probe, static_cast<std::uint32_t>(i)).normal_pair()[0];
  return terms;
}

void exact_sum_add(benchmark::State& state) {
  const auto terms = normal_terms();
  ExactSum sum;
  for (auto _ : state)
    for (const double term : terms) sum.add(term);
  benchmark::DoNotOptimize(sum.value());
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(terms.size()));
}
BENCHMARK(exact_sum_add);

void exact_sum_value(benchmark::State& state) {
  ExactSum sum;
  for (const double term : normal_terms()) sum.add(term);
  for (auto _ : state) benchmark::DoNotOptimize(sum.value());
}
BENCHMARK(exact_sum_value);

}  // namespace
}  // namespace carom
