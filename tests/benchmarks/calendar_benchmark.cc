// SPDX-License-Identifier: BSD-3-Clause
// The event queue: one push and one pop, with the entries of N particles in it.

#include <benchmark/benchmark.h>

#include "engine/base/random.h"
#include "engine/events/calendar.h"

namespace carom {
namespace {

/// An epoch of ten mean times between the events of a particle: all are scheduled, and each that is executed is
/// scheduled again after an exponentially distributed time.
void calendar_epoch(benchmark::State& state) {
  const auto n = static_cast<std::uint32_t>(state.range(0));
  constexpr double kHorizon = 10;
  RandomStream random(1, RandomPurpose::probe, 0);
  std::vector<double> waits(1u << 16);
  for (double& wait : waits) wait = -std::log(random.uniform());
  Calendar calendar;
  std::size_t at = 0;
  std::int64_t served = 0;
  const auto wait = [&] { return waits[at++ % waits.size()]; };
  const auto holds = [](const CalendarEntry&) { return true; };
  for (auto _ : state) {
    calendar.reset(kHorizon, n);
    for (std::uint32_t i = 0; i < n; ++i) calendar.push(wait(), i);
    while (const CalendarEntry* top = calendar.top(holds)) {
      const CalendarEntry entry = *top;
      calendar.pop();
      calendar.push(entry.time + wait(), entry.slot);
      ++served;
    }
  }
  state.SetItemsProcessed(served);
}
BENCHMARK(calendar_epoch)->RangeMultiplier(10)->Range(1000, 1000000)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace carom
