// SPDX-License-Identifier: BSD-3-Clause
#include "engine/forces/simd/pair_kernels.h"

#include <cstdlib>
#include <string>

#include "engine/base/error.h"

namespace carom {
namespace {

bool available(const PairKernels& kernels) {
#if defined(__x86_64__)
  if (&kernels == &kernels::pairs_avx2) return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("popcnt");
  if (&kernels == &kernels::pairs_avx512)
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
           __builtin_cpu_supports("avx512vl");
#endif
  return true;
}

/// The value of CAROM_SIMD; empty: any width.
std::string wanted_width() {
  const char* const wanted = std::getenv("CAROM_SIMD");
  return wanted ? wanted : "";
}

}  // namespace

std::vector<const PairKernels*> available_pair_kernels() {
  std::vector<const PairKernels*> all = {&kernels::pairs_avx512, &kernels::pairs_avx2, &kernels::pairs_sse2};
  const std::string wanted = wanted_width();
  std::erase_if(
      all, [&](const PairKernels* each) { return (!wanted.empty() && wanted != each->name) || !available(*each); });
  return all;
}

const PairKernels& pair_kernels() {
  const auto all = available_pair_kernels();
  if (!all.empty()) return *all.front();
  throw Error(Failure::deck, "CAROM_SIMD=" + wanted_width() +
                                 " names no vector width of this machine; use sse2, avx2 or avx512, or unset it");
}

}  // namespace carom
