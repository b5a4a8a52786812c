#include "engine/pair_kernels.h"

#include <cstdlib>
#include <string>
#include <string_view>

#include "engine/error.h"

namespace carom {
namespace {

bool available(const PairKernels& kernels) {
#if defined(__x86_64__)
  if (&kernels == &kernels::pairs_avx2) return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("popcnt");
  if (&kernels == &kernels::pairs_avx512)
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq");
#endif
  return true;
}

}  // namespace

const PairKernels& pair_kernels() {
  const PairKernels* const all[] = {&kernels::pairs_avx512, &kernels::pairs_avx2, &kernels::pairs_sse2};
  const char* const wanted = std::getenv("CAROM_SIMD");
  for (const PairKernels* each : all) {
    if (wanted && std::string_view(wanted) != each->name) continue;
    if (available(*each)) return *each;
    if (wanted) break;
  }
  throw Error(Failure::deck, "CAROM_SIMD=" + std::string(wanted) +
                                 " names no vector width of this machine; use sse2, avx2 or avx512, or unset it");
}

}  // namespace carom
