// SPDX-License-Identifier: BSD-3-Clause
#include "engine/search/simd/scan.h"

#include <cstdlib>
#include <string>
#include <string_view>

#include "engine/base/error.h"

namespace carom {
namespace {

bool available(const ScanKernels& kernels) {
#if defined(__x86_64__)
  if (&kernels == &kernels::avx2) return __builtin_cpu_supports("avx2");
  if (&kernels == &kernels::avx512) return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq");
#endif
  return true;
}

}  // namespace

const ScanKernels& scan_kernels() {
  const ScanKernels* const all[] = {&kernels::avx512, &kernels::avx2, &kernels::sse2};
  const char* const wanted = std::getenv("CAROM_SIMD");
  for (const ScanKernels* kernels : all) {
    if (wanted && std::string_view(wanted) != kernels->name) continue;
    if (available(*kernels)) return *kernels;
    if (wanted) break;
  }
  throw Error(Failure::deck, "CAROM_SIMD=" + std::string(wanted) +
                                 " names no vector width of this machine; use sse2, avx2 or avx512, or unset it");
}

}  // namespace carom
