// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// What the tables of `carom bench` have in common: how they are printed and stored.

#include <chrono>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "engine/integrators/integrator.h"
#include "io/command/bench.h"

namespace carom::bench {

using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

constexpr std::uint64_t kSeed = 20240117;

inline double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Prints at once. Throws Error(Failure::file).
void say(const std::string& text);

/// The first lines of a table: what made the command.
std::string title();

/// {median, min, max}
Json spread(std::vector<double> values);
/// "min .. max" of these, without decimals.
std::string range(const Json& spread, double unit = 1);

/// Writes {version, compiler, then `results`} to the file of --json, if there is one.
void store(const BenchOptions& options, const Json& results);

}  // namespace carom::bench
