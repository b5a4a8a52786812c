// The event queue: one push and one pop, with the entries of N particles in it.

#include <benchmark/benchmark.h>

#include "engine/calendar.h"
#include "engine/random.h"

namespace carom {
namespace {

/// An epoch of ten mean times between the events of a particle: everybody is scheduled, then each that is served is
/// scheduled anew after an exponential time.
void calendar_epoch(benchmark::State& state) {
  const auto n = static_cast<std::uint32_t>(state.range(0));
  constexpr double kHorizon = 10;
  RandomStream random(1, RandomPurpose::probe, 0);
  std::vector<double> waits(1u << 16);
  for (double& wait : waits) wait = -std::log(random.uniform());
  Calendar calendar;
  std::size_t at = 0, expected = n;
  std::int64_t served = 0;
  const auto wait = [&] { return waits[at++ % waits.size()]; };
  for (auto _ : state) {
    calendar.reset(kHorizon, expected);
    for (std::uint32_t i = 0; i < n; ++i) calendar.push({wait(), i, 0});
    std::size_t count = 0;
    while (const CalendarEntry* top = calendar.top()) {
      CalendarEntry entry = *top;
      calendar.pop();
      entry.time += wait();
      calendar.push(entry);
      ++count;
    }
    expected = count;
    served += static_cast<std::int64_t>(count);
  }
  state.SetItemsProcessed(served);
}
BENCHMARK(calendar_epoch)->RangeMultiplier(10)->Range(1000, 1000000)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace carom
