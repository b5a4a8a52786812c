// SPDX-License-Identifier: BSD-3-Clause
// See scan_kernel.h.
#include "engine/search/simd/scan_kernel.h"

namespace carom {
template <>
const ScanKernels& kernels_of<ScanKernels, 2>() {
  static constexpr ScanKernels kernels{{scan<2, 2>, scan<3, 2>},
                                       {scan_two<2, 2>, scan_two<3, 2>},
                                       {scan_steps<2, 2>, scan_steps<3, 2>},
                                       near,
                                       compare,
                                       heads,
                                       {search<2, 2>, search<3, 2>},
                                       {crossing<2>, crossing<3>}};
  return kernels;
}
}  // namespace carom
