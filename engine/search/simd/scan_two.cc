// SPDX-License-Identifier: BSD-3-Clause
// See scan_kernel.h.
#include "engine/search/simd/scan_kernel.h"

namespace carom {
template <>
const ScanKernels& kernels_of<ScanKernels, 2>() {
  static constexpr ScanKernels kernels = scan_kernels_of<2>();
  return kernels;
}
}  // namespace carom
