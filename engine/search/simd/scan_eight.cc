// SPDX-License-Identifier: BSD-3-Clause
// See scan_kernel.h. AVX-512 instructions, but four candidates at once: a list or a search of cells has few candidates,
// and with eight at once collisions took more time.
#include "engine/search/simd/scan_kernel.h"

namespace carom {
template <>
const ScanKernels& kernels_of<ScanKernels, 8>() {
  static constexpr ScanKernels kernels{{scan<2, 4>, scan<3, 4>},
                                       {scan_two<2, 4>, scan_two<3, 4>},
                                       {scan_steps<2, 4>, scan_steps<3, 4>},
                                       near,
                                       compare,
                                       heads,
                                       {search<2, 4>, search<3, 4>},
                                       {crossing<2>, crossing<3>}};
  return kernels;
}
}  // namespace carom
