// SPDX-License-Identifier: BSD-3-Clause
#include "io/command/bench_table.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cstdio>

#include "engine/base/error.h"
#include "io/files/text_file.h"
#include "io/files/version.h"

namespace carom::bench {

void say(const std::string& text) {
  if (std::fputs(text.c_str(), stdout) < 0 || std::fflush(stdout) != 0)
    throw Error(Failure::file, "standard output: cannot write to it");
}

std::string title() { return "carom " + version_string() + "\n" + compiler_string() + "\n"; }

Json spread(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  const double median = values.size() % 2 == 1 ? values[half] : (values[half - 1] + values[half]) / 2;
  return {{"median", median}, {"min", values.front()}, {"max", values.back()}};
}

std::string range(const Json& spread, double unit) {
  return fmt::format("{:.0f} .. {:.0f}", spread["min"].get<double>() / unit, spread["max"].get<double>() / unit);
}

void store(const BenchOptions& options, const Json& results) {
  if (!options.json) return;
  Json all = {{"version", version_string()}, {"compiler", compiler_string()}};
  all.update(results);
  write_file_atomically(*options.json, all.dump(2) + "\n");
}

}  // namespace carom::bench
