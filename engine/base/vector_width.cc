// SPDX-License-Identifier: BSD-3-Clause
#include "engine/base/vector_width.h"

#include <cstdlib>
#include <string>

#include "engine/base/error.h"

namespace carom {
namespace {

bool machine_has([[maybe_unused]] int lanes) {
#if defined(__x86_64__)
  if (lanes == 4) return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("popcnt");
  if (lanes == 8)
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
           __builtin_cpu_supports("avx512vl");
#endif
  return true;
}

}  // namespace

std::vector<std::size_t> vector_widths() {
  const char* const wanted = std::getenv("CAROM_SIMD");
  std::vector<std::size_t> found;
  std::string names;
  for (std::size_t width = 0; width < std::size(kVectorWidths); ++width) {
    const auto& [name, lanes] = kVectorWidths[width];
    if (!machine_has(lanes)) continue;
    names += std::string(names.empty() ? "" : ", ") + name;
    if (!wanted || std::string(wanted) == name) found.push_back(width);
  }
  if (found.empty())
    throw Error(Failure::deck, "CAROM_SIMD=" + std::string(wanted) +
                                   " names no vector width of this machine, which has " + names +
                                   "; use one of these, or unset it");
  return found;
}

}  // namespace carom
