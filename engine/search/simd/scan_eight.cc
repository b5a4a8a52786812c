// SPDX-License-Identifier: BSD-3-Clause
// See scan_kernel.h. AVX-512 instructions, but four candidates at once: a list or a search of cells has few candidates,
// and with eight at once collisions took more time.
#include "engine/search/simd/scan_kernel.h"

namespace carom {
template <>
const ScanKernels& kernels_of<ScanKernels, 8>() {
  static constexpr ScanKernels kernels = scan_kernels_of<4>();
  return kernels;
}
}  // namespace carom
