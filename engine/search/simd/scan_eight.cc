// SPDX-License-Identifier: BSD-3-Clause
// See scan_kernel.h.
#include "engine/search/simd/scan_kernel.h"

namespace carom {
template <>
const ScanKernels& kernels_of<ScanKernels, 8>() {
  static constexpr ScanKernels kernels{
      8,     {scan<2, 8>, scan<3, 8>},     {scan_two<2, 8>, scan_two<3, 8>}, near, compare,
      heads, {search<2, 8>, search<3, 8>}, {crossing<2>, crossing<3>}};
  return kernels;
}
}  // namespace carom
